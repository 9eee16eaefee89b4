#include "core/blocks/unsymmetric_kernel.h"

#include <string_view>

#define SHEETBEND_DECLARE(variant)                                                                                \
  extern "C" bool sheetbend_factor_unsymmetric_##variant(const sheetbend_blocks::Supernodes&, double* lower,      \
                                                         double* upper, double* inverse, int* from, double* work, \
                                                         int* place);
SHEETBEND_DECLARE(portable)
#ifdef SHEETBEND_X86_KERNELS
SHEETBEND_DECLARE(v3)
SHEETBEND_DECLARE(v4)
#endif

namespace sheetbend {

FactorUnsymmetric unsymmetric_kernel([[maybe_unused]] const sheetbend_packs::KernelTable& kernels) {
#ifdef SHEETBEND_X86_KERNELS
  const std::string_view name = kernels.name;
  if (name == "x86-64-v4") return &sheetbend_factor_unsymmetric_v4;
  if (name == "x86-64-v3") return &sheetbend_factor_unsymmetric_v3;
#endif
  return &sheetbend_factor_unsymmetric_portable;
}

}  // namespace sheetbend
