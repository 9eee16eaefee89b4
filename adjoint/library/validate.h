// What a whole scene must have before it is simulated.
#pragma once

#include <optional>
#include <string>

#include "adjoint/observe/parameter_map.h"
#include "core/scene/scene.h"

namespace sheetbend::library {

struct Fault {
  std::string field, problem, fix;
};

// The first thing that is wrong, if anything: nothing that can move, massless particles, particles connected to
// nothing.
std::optional<Fault> fault_of(const Scene& scene, const ParameterMap& map);

}  // namespace sheetbend::library
