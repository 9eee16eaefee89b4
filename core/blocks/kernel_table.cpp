// Compiled once per instruction set, like adjoint/packs/kernel_table.cpp.
#include "core/blocks/potential.h"

#define SHEETBEND_JOIN_(a, b) a##b
#define SHEETBEND_JOIN(a, b) SHEETBEND_JOIN_(a, b)

extern "C" const sheetbend_blocks::PotentialKernels SHEETBEND_JOIN(sheetbend_potential_,
                                                                   SHEETBEND_VARIANT){sheetbend::PotentialOfBlock::all};
