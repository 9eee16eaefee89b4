// The kernels of one kind in blocks, as the table of an instruction set finds them. They are compiled in a unit of their own (kernels_of_kind.h).
#pragma once

#include "core/blocks/potential_kernels.h"

namespace sheetbend {

template <class K>
struct BlockKernels {
  static constexpr bool hot = K::hot || K::hot_in_blocks;
  static const sheetbend_blocks::KindKernels all;
};

}  // namespace sheetbend
