// Compiled once per instruction set, like adjoint/packs/kernel_table.cpp: the kernels of blocks but for those of the kinds.
#include "adjoint/blocks/block_reverse.h"
#include "adjoint/blocks/kind_kernels.h"
#include "core/blocks/block_tangents.h"
#include "core/blocks/potential.h"
#include "core/constraints/kernels_by_number.h"

#ifdef SHEETBEND_COLD_VARIANT
extern "C" const sheetbend::KernelsByNumber<sheetbend_blocks::KindKernels> SHEETBEND_JOIN(sheetbend_cold_blocks_,
                                                                                          SHEETBEND_COLD_VARIANT);
#endif

namespace sheetbend {
namespace {

using sheetbend_blocks::KindKernels;

#ifdef SHEETBEND_COLD_VARIANT
KernelsByNumber<KindKernels> kinds;  // filled by adjoint/packs/kernel_table.cpp
#else
constinit const auto kinds = kernels_by_number<BlockKernels, KindKernels>();
#endif

// Which of a kind's kernels a block's kernels take.
template <auto part>
struct Part {
  static const auto& of(int kind) { return kinds[kind]->*part; }
};

constexpr sheetbend_blocks::Kernels one{ForwardKernels<double, Part<&KindKernels::forward>>::all,
                                        ReverseKernels<double, Part<&KindKernels::reverse>>::all};
constexpr sheetbend_blocks::Kernels many{ForwardKernels<Pack, Part<&KindKernels::forward_of_lanes>>::all,
                                         ReverseKernels<Pack, Part<&KindKernels::reverse_of_lanes>>::all};

}  // namespace
}  // namespace sheetbend

#ifdef SHEETBEND_COLD_VARIANT
extern "C" void SHEETBEND_JOIN(sheetbend_fill_blocks_, SHEETBEND_VARIANT)() noexcept {
  sheetbend::kinds = sheetbend::kernels_by_number<sheetbend::BlockKernels>(
      SHEETBEND_JOIN(sheetbend_cold_blocks_, SHEETBEND_COLD_VARIANT).data());
}
#endif
extern "C" const sheetbend_blocks::Table SHEETBEND_JOIN(sheetbend_blocks_, SHEETBEND_VARIANT){
    sheetbend::one, sheetbend::many,
    sheetbend::TangentKernels<sheetbend::Part<&sheetbend::KindKernels::tangents>>::all};
extern "C" const sheetbend_blocks::PotentialKernels SHEETBEND_JOIN(sheetbend_potential_, SHEETBEND_VARIANT){
    sheetbend::PotentialOfBlock<sheetbend::Part<&sheetbend::KindKernels::potential>>::all};
