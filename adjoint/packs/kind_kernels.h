// The kernels of one kind in colors, as the table of an instruction set finds them. They are compiled in a unit of their own (kernels_of_kind.h).
#pragma once

#include "core/packs/kernels.h"

namespace sheetbend {

template <class K>
struct PackKernels {
  static constexpr bool hot = K::hot;
  static const sheetbend_packs::KindKernels all;
};

}  // namespace sheetbend
