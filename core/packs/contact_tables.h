// The kernels of contacts, chosen as those of core/packs are (choose.cpp).
#pragma once

#include <string_view>

#include "core/contact/kernels.h"

namespace sheetbend {

// Of an instruction set by its name, which is that of one of available_kernels(); and those of pack_kernels().
const sheetbend_contacts::Table& contact_kernels_of(std::string_view instruction_set);
const sheetbend_contacts::Table& contact_kernels();

}  // namespace sheetbend
