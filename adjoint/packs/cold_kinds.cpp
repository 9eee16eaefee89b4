// Compiled once per instruction set that has kernels of kinds that are not hot: these kernels, for the tables of sets that have none.
#include "adjoint/packs/kind_kernels.h"
#include "core/constraints/kernels_by_number.h"

using Cold = sheetbend::KernelsByNumber<sheetbend_packs::KindKernels>;
extern "C" const Cold SHEETBEND_JOIN(sheetbend_cold_packs_, SHEETBEND_VARIANT);
constinit const Cold SHEETBEND_JOIN(sheetbend_cold_packs_, SHEETBEND_VARIANT) =
    sheetbend::cold_kernels_by_number<sheetbend::PackKernels, sheetbend_packs::KindKernels>();
