// Compiled once per instruction set, like adjoint/packs/kernel_table.cpp.
#include "adjoint/blocks/kernels_of_kind.h"
#include "core/constraints/cold_kinds.h"

#define SHEETBEND_JOIN_(a, b) a##b
#define SHEETBEND_JOIN(a, b) SHEETBEND_JOIN_(a, b)

namespace sheetbend {

#define SHEETBEND_ELSEWHERE(K) SHEETBEND_BLOCK_KERNELS(extern, K)
SHEETBEND_COLD_KINDS(SHEETBEND_ELSEWHERE)

}  // namespace sheetbend

namespace {

template <class T>
constexpr sheetbend_blocks::Kernels kernels{sheetbend::ForwardKernels<T>::all, sheetbend::ReverseKernels<T>::all};

}  // namespace

extern "C" const sheetbend_blocks::Table SHEETBEND_JOIN(sheetbend_blocks_, SHEETBEND_VARIANT){
    kernels<double>, kernels<sheetbend::Pack>, sheetbend::TangentKernels::all};
