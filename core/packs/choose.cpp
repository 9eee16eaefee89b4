// The kernels of this machine.
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "core/packs/packed_colors.h"

#define SHEETBEND_DECLARE(variant) extern "C" const sheetbend_packs::KernelTable* sheetbend_kernels_##variant();
SHEETBEND_DECLARE(portable)
#ifdef SHEETBEND_X86_KERNELS
SHEETBEND_DECLARE(v2)
SHEETBEND_DECLARE(v3)
SHEETBEND_DECLARE(v4)
#endif

namespace sheetbend {
namespace {

struct Variant {
  const char* name;
  bool runs;
  const sheetbend_packs::KernelTable* (*table)();
};

const sheetbend_packs::KernelTable& choose() {
#ifdef SHEETBEND_X86_KERNELS
  __builtin_cpu_init();
  const bool v2 = __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt");
  const bool v3 = v2 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
                  __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("fma");
  const bool v4 = v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                  __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                  __builtin_cpu_supports("avx512vl");
  const Variant variants[] = {{"x86-64-v4", v4, sheetbend_kernels_v4},
                              {"x86-64-v3", v3, sheetbend_kernels_v3},
                              {"x86-64-v2", v2, sheetbend_kernels_v2},
                              {"portable", true, sheetbend_kernels_portable}};
#else
  const Variant variants[] = {{"portable", true, sheetbend_kernels_portable}};
#endif
  const char* wanted = std::getenv("SHEETBEND_ISA");
  for (const Variant& v : variants)
    if (wanted ? std::string(wanted) == v.name : v.runs) {
      if (!v.runs) break;
      return *v.table();
    }
  throw std::runtime_error("SHEETBEND_ISA: this machine or build cannot run '" + std::string(wanted) +
                           "'. Fix: unset it, or use portable");
}

}  // namespace

const sheetbend_packs::KernelTable& pack_kernels() {
  static const sheetbend_packs::KernelTable& chosen = choose();
  return chosen;
}

}  // namespace sheetbend
