// Compiled once per instruction set, with the namespace `sheetbend` renamed (-Dsheetbend=sheetbend_...): templates and inline functions of two
// variants are then different functions, and the linker cannot put one in the place of the other.
#include "adjoint/packs/kernels_of_kind.h"
#include "core/constraints/cold_kinds.h"
#include "core/constraints/registry.h"

#define SHEETBEND_JOIN_(a, b) a##b
#define SHEETBEND_JOIN(a, b) SHEETBEND_JOIN_(a, b)

extern "C" const sheetbend_blocks::Table SHEETBEND_JOIN(sheetbend_blocks_, SHEETBEND_VARIANT);
extern "C" const sheetbend_blocks::PotentialKernels SHEETBEND_JOIN(sheetbend_potential_, SHEETBEND_VARIANT);
extern "C" const sheetbend_points::Table SHEETBEND_JOIN(sheetbend_points_, SHEETBEND_VARIANT);

namespace sheetbend {

#define SHEETBEND_ELSEWHERE(K) SHEETBEND_PACK_KERNELS(extern, K)
SHEETBEND_COLD_KINDS(SHEETBEND_ELSEWHERE)

}  // namespace sheetbend

namespace {

using namespace sheetbend_packs;

template <std::size_t... I>
constexpr KernelTable table(const char* name, std::index_sequence<I...>) {
  return {name,
          {{&sheetbend::project_packs<std::tuple_element_t<I, sheetbend::Registry>, across_color>...},
           {&sheetbend::project_packs<std::tuple_element_t<I, sheetbend::Registry>, across_scenes>...}},
          {&sheetbend::project_tangents<std::tuple_element_t<I, sheetbend::Registry>>...},
          {{&sheetbend::project_packs_vjp<std::tuple_element_t<I, sheetbend::Registry>, across_color>...},
           {&sheetbend::project_packs_vjp<std::tuple_element_t<I, sheetbend::Registry>, across_scenes>...}},
          &SHEETBEND_JOIN(sheetbend_blocks_, SHEETBEND_VARIANT),
          &SHEETBEND_JOIN(sheetbend_potential_, SHEETBEND_VARIANT),
          &SHEETBEND_JOIN(sheetbend_points_, SHEETBEND_VARIANT)};
}

constexpr KernelTable kernels = table(SHEETBEND_VARIANT_NAME, std::make_index_sequence<sheetbend::kind_count>{});

}  // namespace

extern "C" const KernelTable* SHEETBEND_JOIN(sheetbend_kernels_, SHEETBEND_VARIANT)() { return &kernels; }
