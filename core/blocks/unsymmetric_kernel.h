// UnsymmetricSupernodalFactor::factorize (unsymmetric_supernodes.h) as it is compiled for each instruction set.
#pragma once

#include "core/blocks/kernels.h"
#include "core/packs/kernels.h"

namespace sheetbend {

using FactorUnsymmetric = bool (*)(const sheetbend_blocks::Supernodes&, double* lower, double* upper, double* inverse,
                                   int* from, double* work, int* place);

// The one of the same instruction set as these kernels.
FactorUnsymmetric unsymmetric_kernel(const sheetbend_packs::KernelTable& kernels);

}  // namespace sheetbend
