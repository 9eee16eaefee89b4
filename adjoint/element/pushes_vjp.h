// The reverse of the pushes J^T lambda of one constraint, in its coordinates and parameters.
#pragma once

#include "adjoint/element/constraint_vjp.h"

namespace sheetbend {

// Of z . J^T lambda - y . C with z (dofs), lambda and y (rows) held: x_bar += sum_j lambda_j Hess(C_j) z, without what y sends to the coordinates, and
// p_bar += sum_j lambda_j z . dJ_j/dp - y_j dC_j/dp.
template <class K, class T>
void pushes_vjp(const T* x, const T* p, const T* lambda, const T* y, const T* z, T* x_bar, T* p_bar) {
  if constexpr (HasReverse<K>) {
    T none[K::dofs];
    for (T& a : none) a = T(0.0);
    K::reverse(x, p, lambda, y, z, none, x_bar, p_bar);
  } else {
    T along[K::rows * K::dofs];
    for (int j = 0; j < K::rows; ++j)
      for (int d = 0; d < K::dofs; ++d) along[j * K::dofs + d] = lambda[j] * z[d];
    gradients_vjp<K>(x, p, y, along, x_bar, p_bar);
  }
}

}  // namespace sheetbend
