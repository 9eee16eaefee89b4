// Compiled once per instruction set, like adjoint/packs/kernel_table.cpp: the kernels of blocks but for those of the kinds.
#include <tuple>

#include "adjoint/blocks/block_reverse.h"
#include "adjoint/blocks/kind_kernels.h"
#include "core/blocks/block_tangents.h"
#include "core/blocks/potential.h"
#include "core/constraints/registry.h"

#define SHEETBEND_JOIN_(a, b) a##b
#define SHEETBEND_JOIN(a, b) SHEETBEND_JOIN_(a, b)

namespace sheetbend {
namespace {

using sheetbend_blocks::KindKernels;

constexpr auto kinds = []<class... K>(std::tuple<K...>*) {
  return std::array{&BlockKernels<K>::all...};
}(static_cast<Registry*>(nullptr));

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

extern "C" const sheetbend_blocks::Table SHEETBEND_JOIN(sheetbend_blocks_, SHEETBEND_VARIANT){
    sheetbend::one, sheetbend::many,
    sheetbend::TangentKernels<sheetbend::Part<&sheetbend::KindKernels::tangents>>::all};
extern "C" const sheetbend_blocks::PotentialKernels SHEETBEND_JOIN(sheetbend_potential_, SHEETBEND_VARIANT){
    sheetbend::PotentialOfBlock<sheetbend::Part<&sheetbend::KindKernels::potential>>::all};
