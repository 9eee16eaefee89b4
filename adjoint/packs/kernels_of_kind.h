// The kernels of one kind in colors, for explicit instantiation: `where` is empty or `extern`.
#pragma once

#include "adjoint/packs/project_packs_vjp.h"
#include "core/packs/project_tangents.h"

#define SHEETBEND_PACK_KERNELS(where, K)                                                                              \
  where template void project_packs<K, sheetbend_packs::across_color>(const sheetbend_packs::Forward&, int, int);     \
  where template void project_packs<K, sheetbend_packs::across_scenes>(const sheetbend_packs::Forward&, int, int);    \
  where template void project_tangents<K>(const sheetbend_packs::Tangents&, int, int);                                \
  where template void project_packs_vjp<K, sheetbend_packs::across_color>(const sheetbend_packs::Reverse&, int, int); \
  where template void project_packs_vjp<K, sheetbend_packs::across_scenes>(const sheetbend_packs::Reverse&, int, int);
