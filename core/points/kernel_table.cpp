// Compiled once per instruction set, like adjoint/packs/kernel_table.cpp.
#include "core/points/point_kernels.h"

#define SHEETBEND_JOIN_(a, b) a##b
#define SHEETBEND_JOIN(a, b) SHEETBEND_JOIN_(a, b)

extern "C" const sheetbend_points::Table SHEETBEND_JOIN(sheetbend_points_, SHEETBEND_VARIANT){
    sheetbend::PointKernels<sheetbend::Pack>::all, sheetbend::PointKernels<sheetbend::Dual<double, 4>>::all,
    sheetbend::PointKernels<sheetbend::Dual<double, 8>>::all};
