// Compiled once per instruction set that has kernels of kinds that are not hot: these kernels, for the tables of sets that have none.
#include "adjoint/blocks/kind_kernels.h"
#include "core/constraints/kernels_by_number.h"

using Cold = sheetbend::KernelsByNumber<sheetbend_blocks::KindKernels>;
extern "C" const Cold SHEETBEND_JOIN(sheetbend_cold_blocks_, SHEETBEND_VARIANT);
constinit const Cold SHEETBEND_JOIN(sheetbend_cold_blocks_, SHEETBEND_VARIANT) =
    sheetbend::cold_kernels_by_number<sheetbend::BlockKernels, sheetbend_blocks::KindKernels>();
