// The reverse of the block projection on one element, once for every constraint and every solver. With cotangents x'_bar and lambda'_bar:
//
//   y = A^-1 (lambda'_bar + J W x'_bar)        s_bar = -y/(1+g)        z = x'_bar - J^T y        dx = W J^T dl
//   v_j = dl_j W z - y_j dx                    one direction per scalar constraint
//   x_bar = z + sum_j Hess(C_j) v_j            lambda_bar = lambda'_bar + a s_bar      a_bar = s_bar . lambda'
//   w_bar_i = (J^T dl)_i . z_i                 g_bar = -s_bar . (C_r + a lambda')/(1+g) C_r_bar = -g s_bar
//   p_bar = sum_j -y_j dC_j/dp + v_j . dJ_j/dp
//
// Only "solve with A" differs between solvers. Hess(C_j) v_j and the parameter derivatives are one evaluation of the constraint on dual
// numbers with a direction per row and per parameter that is not just subtracted, or the constraint's own reverse (constraint_vjp.h). ../DERIVATION.md derives it. Where the numbers are
// stored is not known here.
#pragma once

#include "adjoint/element/constraint_vjp.h"
#include "core/element/element.h"

namespace sheetbend {

// Cotangents of an element's own numbers, to be added to.
template <class K, class T>
struct ElementCotangent {
  T a{}, g{};
  T p[parameter_count<K> > 0 ? parameter_count<K> : 1]{};
  T lambda[K::rows]{}, C_r[K::rows]{};
};

// What does not need second derivatives. C_r is null where nothing is damped; angles have it on the branch next to C.
template <class K, class T>
void pull_back_rates(const Element<K, T>& e, const T* lambda, const T* C_r, const T* dl, const T* y, int j,
                     ElementCotangent<K, T>& bar) {
  const T s_bar = -(y[j] * e.rates.scale), lambda_next = lambda[j] + dl[j];
  bar.a += s_bar * lambda_next;
  bar.lambda[j] += e.rates.a * s_bar;
  if (!C_r) return;
  bar.g -= s_bar * (e.rates.scale * (C_r[j] + e.rates.a * lambda_next));
  bar.C_r[j] -= e.rates.g * s_bar;
}

// Everything after the solve; z and u = J^T dl are the block's, on the element's stencil. Adds Hess(C_j) v_j to x_bar. The second derivatives
// are the constraint's own geometry's, otherwise those of constraint_vjp.h. `alone`: a block of one with unit gradients. There
// Hess(C) W J^T = 0, so that of v = W (dl z - y u) the first part is enough.
template <bool alone = false, class K, class T>
void pull_back(const Element<K, T>& e, const Kept<K, T>& at, const T* lambda, const T* C_r, const T* dl, const T* y,
               const T* z, const T* u, T* x_bar, ElementCotangent<K, T>& bar) {
  const auto v = [&](int j, int d) {
    if constexpr (alone)
      return dl[j] * (e.w[d / 3] * z[d]);
    else
      return e.w[d / 3] * (dl[j] * z[d] - y[j] * u[d]);
  };
  T near[K::rows];
  if constexpr (HasGeometry<K>) {
    T along[K::dofs];
    unrolled<K::dofs>([&](int d) { along[d] = v(0, d); });
    at.add_hessian_times(along, x_bar);
    for (int k = 0; k < parameter_count<K>; ++k) bar.p[k] += y[k];  // C = f(x) - p
  } else if constexpr (HasReverse<K>) {
    T a[K::dofs], b[K::dofs];
    for (int d = 0; d < K::dofs; ++d) {
      a[d] = e.w[d / 3] * z[d];
      b[d] = e.w[d / 3] * u[d];
    }
    K::reverse(at.x, e.p, dl, y, a, b, x_bar, bar.p);
  } else {
    T along[K::rows * K::dofs];
    for (int j = 0; j < K::rows; ++j)
      for (int d = 0; d < K::dofs; ++d) along[j * K::dofs + d] = v(j, d);
    gradients_vjp<K>(at.x, e.p, y, along, x_bar, bar.p);
    if constexpr (K::periodic)
      if (C_r) C_r = on_branch<K>(at.x, e.p, C_r, near);
  }
  for (int j = 0; j < K::rows; ++j) pull_back_rates(e, lambda, C_r, dl, y, j, bar);
}

// y = A^-1 y. Where a unilateral constraint has let go, dl = -lambda: A and s have no part in it, so y is 0, and lambda_bar - lambda'_bar, returned,
// is what takes the right side away.
template <class K, class T, class Gradient>
T solve_unless_let_go(const Element<K, T>& e, const Gradient& J, const T* lambda, const T* dl, T* y) {
  const T right = y[0], zero(0.0);
  e.solve(J, y);
  const auto holds = lambda[0] + dl[0] > zero;
  y[0] = select(holds, y[0], zero);
  return select(holds, zero, -right);
}

// The reverse of Correction: a constraint by itself. x_bar (dofs) goes in as x'_bar, zero where nothing can move, and comes out as what is to be
// added to it; w_bar (arity) and bar are written.
template <class K, class T>
void correction_vjp(const Element<K, T>& e, const Kept<K, T>& at, const T* lambda, const T* C_r, const T* dl,
                    const T* lambda_bar, T* x_bar, T* w_bar, ElementCotangent<K, T>& bar) {
  T y[K::rows], z[K::dofs], u[K::dofs], back[K::dofs];
  const auto J = gradient_of(at, e.p);
  const auto solve = [&] {
    if constexpr (K::unilateral)
      bar.lambda[0] = solve_unless_let_go(e, J, lambda, dl, y);
    else
      e.solve(J, y);
  };
  if constexpr (K::unit_gradients) {
    // |J_k| = 1; and since Hess(C) W J^T = 0, z may be x'_bar itself
    T along[K::arity];
    y[0] = lambda_bar[0];
    unrolled<K::arity>([&](int k) {
      along[k] = dot(Vec3<T>(J.J + 3 * k), Vec3<T>(x_bar + 3 * k));
      y[0] += e.w[k] * along[k];
    });
    solve();
    unrolled<K::arity>([&](int k) { w_bar[k] = dl[0] * (along[k] - y[0]); });
    J.transpose_times(dl, u);
    J.transpose_times(y, back);
    unrolled<K::dofs>([&](int d) { z[d] = x_bar[d]; });
  } else {
    T moved[K::dofs];
    unrolled<K::dofs>([&](int d) { moved[d] = e.w[d / 3] * x_bar[d]; });
    for (int j = 0; j < K::rows; ++j) y[j] = lambda_bar[j];
    J.add_times(moved, y);
    solve();
    J.transpose_times(dl, u);
    J.transpose_times(y, back);
    for (int d = 0; d < K::dofs; ++d) z[d] = x_bar[d] - back[d];
    for (int k = 0; k < K::arity; ++k) w_bar[k] = dot(Vec3<T>(u + 3 * k), Vec3<T>(z + 3 * k));
  }
  unrolled<K::dofs>([&](int d) { x_bar[d] = -back[d]; });
  pull_back<K::unit_gradients>(e, at, lambda, C_r, dl, y, z, u, x_bar, bar);
}

}  // namespace sheetbend
