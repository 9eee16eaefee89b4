// The kernels of this machine.
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "core/packs/packed_colors.h"

#define SHEETBEND_DECLARE(variant) \
  extern "C" const sheetbend_packs::KernelTable* sheetbend_kernels_##variant() noexcept;
SHEETBEND_DECLARE(portable)
#ifdef SHEETBEND_X86_KERNELS
SHEETBEND_DECLARE(v3)
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
#ifdef SHEETBEND_X86_KERNELS
  __builtin_cpu_init();
  const bool v3 = __builtin_cpu_supports("popcnt") && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
                  __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("fma");
  const bool v4 = v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                  __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                  __builtin_cpu_supports("avx512vl");
  if (v4) available.push_back(sheetbend_kernels_v4());
  if (v3) available.push_back(sheetbend_kernels_v3());
#endif
  available.push_back(sheetbend_kernels_portable());
  return available;
}

const sheetbend_packs::KernelTable& pack_kernels() {
  static const sheetbend_packs::KernelTable& chosen = choose();
  return chosen;
}

}  // namespace sheetbend
