// Compiled once per instruction set, with the namespace `sheetbend` renamed (-Dsheetbend=sheetbend_...): templates and inline functions of two
// variants are then different functions, and the linker cannot put one in the place of the other. The kernels of each kind are compiled in a unit of
// their own, which cmake/Kernels.cmake makes from the registry.
#include <array>
#include <tuple>

#include "adjoint/packs/kind_kernels.h"
#include "core/constraints/registry.h"

#define SHEETBEND_JOIN_(a, b) a##b
#define SHEETBEND_JOIN(a, b) SHEETBEND_JOIN_(a, b)

extern "C" const sheetbend_blocks::Table SHEETBEND_JOIN(sheetbend_blocks_, SHEETBEND_VARIANT);
extern "C" const sheetbend_blocks::PotentialKernels SHEETBEND_JOIN(sheetbend_potential_, SHEETBEND_VARIANT);
extern "C" const sheetbend_points::Table SHEETBEND_JOIN(sheetbend_points_, SHEETBEND_VARIANT);
extern "C" sheetbend_blocks::FactorUnsymmetric SHEETBEND_JOIN(sheetbend_factor_unsymmetric_, SHEETBEND_VARIANT);

namespace {

constexpr auto kinds = []<class... K>(std::tuple<K...>*) {
  return std::array{&sheetbend::PackKernels<K>::all...};
}(static_cast<sheetbend::Registry*>(nullptr));

constexpr sheetbend_packs::KernelTable kernels{SHEETBEND_VARIANT_NAME,
                                               kinds.data(),
                                               &SHEETBEND_JOIN(sheetbend_blocks_, SHEETBEND_VARIANT),
                                               &SHEETBEND_JOIN(sheetbend_potential_, SHEETBEND_VARIANT),
                                               &SHEETBEND_JOIN(sheetbend_points_, SHEETBEND_VARIANT),
                                               &SHEETBEND_JOIN(sheetbend_factor_unsymmetric_, SHEETBEND_VARIANT)};

}  // namespace

extern "C" const sheetbend_packs::KernelTable* SHEETBEND_JOIN(sheetbend_kernels_, SHEETBEND_VARIANT)() {
  return &kernels;
}
