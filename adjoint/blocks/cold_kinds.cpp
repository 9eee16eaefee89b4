// Compiled once per instruction set, like kernel_table.cpp, which takes from here what is not inlined as a whole.
#include "adjoint/blocks/kernels_of_kind.h"
#include "core/constraints/cold_kinds.h"
#include "core/constraints/registry.h"

namespace sheetbend {

#define SHEETBEND_HERE(K) SHEETBEND_BLOCK_KERNELS(, K)
SHEETBEND_COLD_KINDS(SHEETBEND_HERE)

}  // namespace sheetbend
