// Reads the file of a scene, which docs/scene_file.md describes. Every part is checked where it is read.
#pragma once

#include <filesystem>

#include "adjoint/library/model.h"

namespace sheetbend::library {

// Throws InputError, which names the file and the part at fault.
v0::Model read_scene_file(const std::filesystem::path& path);

}  // namespace sheetbend::library
