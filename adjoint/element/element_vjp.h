// The reverse of the block projection on one element, once for every constraint and every solver. With cotangents x'_bar and lambda'_bar:
//
//   y = A^-1 (lambda'_bar + J W x'_bar)        s_bar = -y/(1+g)        z = x'_bar - J^T y        dx = W J^T dl
//   v_j = dl_j W z - y_j dx                    one direction per scalar constraint
//   x_bar = z + sum_j Hess(C_j) v_j            lambda_bar = lambda'_bar + a s_bar      a_bar = s_bar . lambda'
//   w_bar_i = (J^T dl)_i . z_i                 g_bar = s_bar . (C - C_r + J dx)        C_r_bar = -g s_bar
//   p_bar = sum_j -y_j dC_j/dp + v_j . dJ_j/dp
//
// Only "solve with A" differs between solvers. Hess(C_j) v_j and the parameter derivatives are one evaluation of the constraint on dual
// numbers with rows + parameters directions. DERIVATION.md beside this file derives it. Where the numbers are stored is not known here.
#pragma once

#include "core/element/element.h"
#include "core/scalar/dual.h"

namespace sheetbend {

// Cotangents of an element's own numbers, to be added to.
template <class K, class T>
struct ElementCotangent {
  T a{}, g{};
  T p[parameter_count<K> > 0 ? parameter_count<K> : 1]{};
  T lambda[K::rows]{}, C_r[K::rows]{};
};

// Everything after the solve; z and u = J^T dl are the block's, on the element's stencil. Adds Hess(C_j) v_j to x_bar.
template <class K, class T>
void pull_back(const Element<K, T>& e, const T* lambda, const T* C_r, const T* dl, const T* y, const T* z, const T* u,
               T* x_bar, ElementCotangent<K, T>& bar) {
  constexpr int P = parameter_count<K>, N = K::rows + P;
  using D = Dual<T, N>;
  T v[K::rows][K::dofs];
  D x[K::dofs], p[P > 0 ? P : 1], C[K::rows], J[K::rows * K::dofs];
  for (int d = 0; d < K::dofs; ++d) {
    x[d].v = e.x[d];
    for (int j = 0; j < K::rows; ++j) x[d].d[j] = v[j][d] = e.w[d / 3] * (dl[j] * z[d] - y[j] * u[d]);
  }
  for (int k = 0; k < P; ++k) {
    p[k].v = e.p[k];
    p[k].d[K::rows + k] = T(1.0);
  }
  K::evaluate(x, p, C, J);

  for (int j = 0; j < K::rows; ++j) {
    const T s_bar = -(y[j] * e.rates.scale);
    for (int d = 0; d < K::dofs; ++d) x_bar[d] += J[j * K::dofs + d].d[j];
    bar.a += s_bar * (lambda[j] + dl[j]);
    bar.lambda[j] += e.rates.a * s_bar;
    if (C_r) {
      T J_dx(0.0);
      for (int d = 0; d < K::dofs; ++d) J_dx += J[j * K::dofs + d].v * e.w[d / 3] * u[d];
      bar.g += s_bar * (difference<K>(C[j].v, C_r[j]) + J_dx);
      bar.C_r[j] -= e.rates.g * s_bar;
    }
    for (int k = 0; k < P; ++k) {
      T p_bar = -(y[j] * C[j].d[K::rows + k]);
      for (int d = 0; d < K::dofs; ++d) p_bar += v[j][d] * J[j * K::dofs + d].d[K::rows + k];
      bar.p[k] += p_bar;
    }
  }
}

// y = lambda'_bar + J W x'_bar.
template <class K, class T>
void adjoint_right_side(const Element<K, T>& e, const T* J, const T* lambda_bar, const T* x_bar, T* y) {
  for (int j = 0; j < K::rows; ++j) {
    y[j] = lambda_bar[j];
    for (int d = 0; d < K::dofs; ++d) y[j] += J[j * K::dofs + d] * (e.w[d / 3] * x_bar[d]);
  }
}

// The reverse of Correction: a constraint by itself. x_bar (dofs) goes in as x'_bar, zero where nothing can move, and comes out as what is to be
// added to it; w_bar (arity) and bar are written.
template <class K, class T>
void correction_vjp(const Element<K, T>& e, const T* lambda, const T* C_r, const T* dl, const T* lambda_bar, T* x_bar,
                    T* w_bar, ElementCotangent<K, T>& bar) {
  const Evaluation<K, T> value(e.x, e.p);
  T A[K::rows * K::rows], y[K::rows], z[K::dofs], u[K::dofs]{}, back[K::dofs]{};
  e.matrix(value.J, A);
  adjoint_right_side(e, value.J, lambda_bar, x_bar, y);
  SmallLdlt<K::rows, T>(A).solve(y);
  transpose_times<K>(value.J, dl, u);
  transpose_times<K>(value.J, y, back);
  for (int d = 0; d < K::dofs; ++d) {
    z[d] = x_bar[d] - back[d];
    x_bar[d] = -back[d];
  }
  for (int k = 0; k < K::arity; ++k) w_bar[k] = dot(Vec3<T>(u + 3 * k), Vec3<T>(z + 3 * k));
  pull_back(e, lambda, C_r, dl, y, z, u, x_bar, bar);
}

}  // namespace sheetbend
