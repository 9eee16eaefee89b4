// One constraint inside a substep: its local coordinates and weights, its coefficients, and the residual s of the block projection
//   a = alpha / eta^2,  g = alpha beta / eta,  s = C + a lambda + g (C - C_r)
// (XPBD, Macklin et al. 2016, eq. 18 and 26, with the damping by the constraint's own rate; eta is h for BDF1, 2h/3 for BDF2).
// Nothing here knows where the numbers are stored, so one constraint and eight in the lanes of a pack go through the same lines.
#pragma once

#include "core/element/linearization.h"
#include "core/element/small_ldlt.h"

namespace sheetbend {

template <class T>
struct Rates {
  T a{}, g{}, scale{1.0};  // scale = 1/(1+g)
  Rates() = default;
  Rates(const T& alpha, const T& beta, double eta)
      : a(alpha * T(1.0 / (eta * eta))), g(alpha * beta * T(1.0 / eta)), scale(T(1.0) / (T(1.0) + g)) {}
};

template <class K, class T>
struct Element {
  T x[K::dofs], w[K::arity];                               // coordinates and effective inverse masses on the stencil
  T p[parameter_count<K> > 0 ? parameter_count<K> : 1]{};  // the constraint's own parameters
  Rates<T> rates;
  T inverse{};  // of the matrix, where the gradients are unit vectors and it does not depend on x

  // C_r is null where nothing is damped.
  T residual(const T* C, const T* lambda, const T* C_r, int row) const {
    T r = C[row] + rates.a * lambda[row];
    if (C_r) r += rates.g * difference<K>(C[row], C_r[row]);
    return r;
  }

  // b = A^-1 b, A = J W J^T + a/(1+g).
  template <class Gradient>
  void solve(const Gradient& J, T* b) const {
    if constexpr (K::unit_gradients) {
      b[0] = b[0] * inverse;
    } else {
      T A[K::rows * K::rows];
      J.matrix(w, A);
      for (int i = 0; i < K::rows; ++i) A[i * K::rows + i] = A[i * K::rows + i] + rates.a * rates.scale;
      SmallLdlt<K::rows, T>(A, redundant_pivot).solve(b);
    }
  }
};

// The inverse of A = sum w + a/(1+g), for one row with unit gradients.
template <class T>
T inverse_of_unit_matrix(const T& sum_of_w, const Rates<T>& rates) {
  return inverse_or_zero(sum_of_w + rates.a * rates.scale);
}

// The projection of one constraint by itself: dl, and the push J^T dl that its particles get times their inverse masses. A unilateral one lets go
// where its multiplier would change sign: then dl = -lambda.
template <class K, class T>
struct Correction {
  T dl[K::rows], push[K::dofs];

  Correction(const Element<K, T>& e, const Linearization<K, T>& value, const T* lambda, const T* C_r) {
    const auto& J = value.gradient();
    for (int j = 0; j < K::rows; ++j) dl[j] = -(e.residual(value.C, lambda, C_r, j) * e.rates.scale);
    e.solve(J, dl);
    if constexpr (K::unilateral) dl[0] = select(lambda[0] + dl[0] > T(0.0), dl[0], -lambda[0]);
    J.transpose_times(dl, push);
  }
};

}  // namespace sheetbend
