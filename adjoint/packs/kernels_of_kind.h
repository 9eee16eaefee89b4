// Included where the kernels of one kind in colors are compiled: `template struct PackKernels<K>;`.
#pragma once

#include "adjoint/packs/kind_kernels.h"
#include "adjoint/packs/project_packs_vjp.h"
#include "core/packs/project_tangents.h"

namespace sheetbend {

template <class K>
constinit const sheetbend_packs::KindKernels PackKernels<K>::all{
    {&project_packs<K, sheetbend_packs::across_color>, &project_packs<K, sheetbend_packs::across_scenes>},
    &project_tangents<K>,
    {&project_packs_vjp<K, sheetbend_packs::across_color>, &project_packs_vjp<K, sheetbend_packs::across_scenes>}};

}  // namespace sheetbend
