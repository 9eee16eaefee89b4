// Compiled once per instruction set, with the namespace `sheetbend` renamed (-Dsheetbend=sheetbend_...): templates and inline functions of two
// variants are then different functions, and the linker cannot put one in the place of the other. The kernels of each kind are compiled in a unit of
// their own, which cmake/Kernels.cmake makes from the registry.
#include "adjoint/packs/kind_kernels.h"
#include "core/constraints/kernels_by_number.h"

extern "C" const sheetbend_blocks::Table SHEETBEND_JOIN(sheetbend_blocks_, SHEETBEND_VARIANT);
extern "C" const sheetbend_blocks::PotentialKernels SHEETBEND_JOIN(sheetbend_potential_, SHEETBEND_VARIANT);
extern "C" const sheetbend_points::Table SHEETBEND_JOIN(sheetbend_points_, SHEETBEND_VARIANT);
extern "C" sheetbend_blocks::FactorUnsymmetric SHEETBEND_JOIN(sheetbend_factor_unsymmetric_, SHEETBEND_VARIANT);

using sheetbend_packs::KindKernels;

#ifdef SHEETBEND_COLD_VARIANT
extern "C" const sheetbend::KernelsByNumber<KindKernels> SHEETBEND_JOIN(sheetbend_cold_packs_, SHEETBEND_COLD_VARIANT);
extern "C" void SHEETBEND_JOIN(sheetbend_fill_blocks_, SHEETBEND_VARIANT)() noexcept;
#endif

namespace {

#ifdef SHEETBEND_COLD_VARIANT
// Filled when they are asked for: where the machine lacks this instruction set, none of its code may run, not even when the program is loaded.
sheetbend::KernelsByNumber<KindKernels> kinds;
#else
constinit const auto kinds = sheetbend::kernels_by_number<sheetbend::PackKernels, KindKernels>();
#endif

constexpr sheetbend_packs::KernelTable kernels{SHEETBEND_VARIANT_NAME,
                                               kinds.data(),
                                               &SHEETBEND_JOIN(sheetbend_blocks_, SHEETBEND_VARIANT),
                                               &SHEETBEND_JOIN(sheetbend_potential_, SHEETBEND_VARIANT),
                                               &SHEETBEND_JOIN(sheetbend_points_, SHEETBEND_VARIANT),
                                               &SHEETBEND_JOIN(sheetbend_factor_unsymmetric_, SHEETBEND_VARIANT)};

}  // namespace

extern "C" const sheetbend_packs::KernelTable* SHEETBEND_JOIN(sheetbend_kernels_, SHEETBEND_VARIANT)() noexcept {
#ifdef SHEETBEND_COLD_VARIANT
  static const bool filled = [] {
    const auto& cold = SHEETBEND_JOIN(sheetbend_cold_packs_, SHEETBEND_COLD_VARIANT);
    kinds = sheetbend::kernels_by_number<sheetbend::PackKernels>(cold.data());
    SHEETBEND_JOIN(sheetbend_fill_blocks_, SHEETBEND_VARIANT)();
    return true;
  }();
  static_cast<void>(filled);
#endif
  return &kernels;
}
