// Compiled once per instruction set, like adjoint/packs/kernel_table.cpp.
#include "adjoint/blocks/block_reverse.h"
#include "core/blocks/block_tangents.h"

#define SHEETBEND_JOIN_(a, b) a##b
#define SHEETBEND_JOIN(a, b) SHEETBEND_JOIN_(a, b)

namespace {

template <class T>
constexpr sheetbend_blocks::Kernels kernels{sheetbend::ForwardKernels<T>::all, sheetbend::ReverseKernels<T>::all};

}  // namespace

extern "C" const sheetbend_blocks::Table SHEETBEND_JOIN(sheetbend_blocks_, SHEETBEND_VARIANT){
    kernels<double>, kernels<sheetbend::Pack>, sheetbend::TangentKernels::all};
