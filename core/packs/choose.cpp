// The kernels of this machine.
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "core/packs/instruction_sets.h"
#include "core/packs/packed_colors.h"

#define SHEETBEND_DECLARE(variant) \
  extern "C" const sheetbend_packs::KernelTable* sheetbend_kernels_##variant() noexcept;
SHEETBEND_DECLARE(portable)
#ifdef SHEETBEND_KERNELS_V3
SHEETBEND_DECLARE(v3)
#endif
#ifdef SHEETBEND_KERNELS_V4
SHEETBEND_DECLARE(v4)
#endif

namespace sheetbend {
namespace {

const sheetbend_packs::KernelTable& choose() {
  const auto available = available_kernels();
  const char* wanted = std::getenv("SHEETBEND_ISA");
  if (!wanted) return *available.front();
  std::string names;
  for (const auto* kernels : available) {
    if (std::string(wanted) == kernels->name) return *kernels;
    names += (names.empty() ? "" : ", ") + std::string(kernels->name);
  }
  throw std::runtime_error("SHEETBEND_ISA: this machine or build has no kernels '" + std::string(wanted) +
                           "'. Fix: unset it, or use one of: " + names);
}

}  // namespace

std::vector<const sheetbend_packs::KernelTable*> available_kernels() {
  std::vector<const sheetbend_packs::KernelTable*> available;
#ifdef SHEETBEND_KERNELS_V4
  if (runs_v4()) available.push_back(sheetbend_kernels_v4());
#endif
#ifdef SHEETBEND_KERNELS_V3
  if (runs_v3()) available.push_back(sheetbend_kernels_v3());
#endif
  available.push_back(sheetbend_kernels_portable());
  return available;
}

std::vector<const char*> compiled_instruction_sets() {
  return {
#ifdef SHEETBEND_KERNELS_V4
      "x86-64-v4",
#endif
#ifdef SHEETBEND_KERNELS_V3
      "x86-64-v3",
#endif
      "portable"};
}

const sheetbend_packs::KernelTable& pack_kernels() {
  static const sheetbend_packs::KernelTable& chosen = choose();
  return chosen;
}

}  // namespace sheetbend
