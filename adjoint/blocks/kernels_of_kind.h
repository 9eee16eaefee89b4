// Included where the kernels of one kind in blocks are compiled: `template struct BlockKernels<K>;`.
#pragma once

#include "adjoint/blocks/kind_kernels.h"
#include "adjoint/blocks/reverse_of_kind.h"
#include "core/blocks/forward_of_kind.h"
#include "core/blocks/potential_of_kind.h"
#include "core/blocks/tangents_of_kind.h"

namespace sheetbend {

template <class K>
constinit const sheetbend_blocks::KindKernels BlockKernels<K>::all{
    forward_of_kind<K, double>(), forward_of_kind<K, Pack>(), reverse_of_kind<K, double>(),
    reverse_of_kind<K, Pack>(),   tangents_of_kind<K>(),      potential_of_kind<K>()};

}  // namespace sheetbend
