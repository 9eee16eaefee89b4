// Compiled once per instruction set, like adjoint/packs/kernel_table.cpp.
#include "core/blocks/unsymmetric_supernodes.h"

#define SHEETBEND_JOIN_(a, b) a##b
#define SHEETBEND_JOIN(a, b) SHEETBEND_JOIN_(a, b)

extern "C" bool SHEETBEND_JOIN(sheetbend_factor_unsymmetric_,
                               SHEETBEND_VARIANT)(const sheetbend_blocks::Supernodes& s, double* lower, double* upper,
                                                  double* inverse, int* from, double* work, int* place) {
  return sheetbend::UnsymmetricSupernodalFactor{s, lower, upper, inverse, from, work, place}.factorize();
}
