// What the reverse asks of a constraint at (x, p): with its own reverse where it has one (concept.h), otherwise by one evaluation on dual numbers.
#pragma once

#include "core/element/element.h"
#include "core/scalar/dual.h"

namespace sheetbend {

// Parameters that the gradient may depend on: after a factor, before those that are just subtracted.
template <class K>
inline constexpr int inside_count = parameter_count<K> - K::offsets - K::factors;

// With a factor the constraint is evaluated as if it were 1 and nothing were subtracted; what is asked of the last row is multiplied by it instead.
template <class K, class T, class D>
void load_inside(const T* p, D* with) {
  constexpr int end = K::factors + inside_count<K>;
  for (int k = K::factors; k < end; ++k) with[k] = D(p[k]);
  for (int k = 0; k < K::factors; ++k) with[k] = D(T(1.0));
  for (int k = end; k < parameter_count<K>; ++k) with[k] = K::factors ? D(T(0.0)) : D(p[k]);
}
template <class K, class T>
T times_factor(const T* p, int row, const T& a) {
  if constexpr (K::factors)
    if (row == K::rows - 1) return p[0] * a;
  return a;
}

// x_bar += J^T C_bar, p_bar += C_bar . dC/dp.
template <class K, class T>
void values_vjp(const T* x, const T* p, const T* C_bar, T* x_bar, T* p_bar) {
  constexpr int inside = HasReverse<K> ? 0 : inside_count<K>;
  using D = std::conditional_t<inside == 0, T, Dual<T, inside>>;
  D at[K::dofs], with[parameter_count<K> + 1], C[K::rows], J[K::rows * K::dofs];
  for (int d = 0; d < K::dofs; ++d) at[d] = D(x[d]);
  load_inside<K>(p, with);
  if constexpr (inside > 0)
    for (int k = 0; k < inside; ++k) with[K::factors + k].d[k] = T(1.0);
  evaluate_on_duals<K, inside>(at, with, C, J);
  for (int j = 0; j < K::rows; ++j) {
    const T bar = times_factor<K>(p, j, C_bar[j]);
    for (int d = 0; d < K::dofs; ++d) x_bar[d] += bar * primal<T>(J[j * K::dofs + d]);
    if constexpr (inside > 0)
      for (int k = 0; k < inside; ++k) p_bar[K::factors + k] += bar * C[j].d[k];
    if constexpr (!HasReverse<K>)
      if (j < K::offsets) p_bar[K::factors + inside + j] -= C_bar[j];
  }
  if constexpr (K::factors) p_bar[0] += C_bar[K::rows - 1] * primal<T>(C[K::rows - 1]);
  if constexpr (HasReverse<K>) {
    T y[K::rows], still[std::max(K::rows, K::dofs)], unused[K::dofs];
    for (int j = 0; j < K::rows; ++j) y[j] = -C_bar[j];
    for (T& v : still) v = T(0.0);
    for (T& v : unused) v = T(0.0);
    K::reverse(x, p, still, y, still, still, unused, p_bar);
  }
}

// Of sum_j (v_j . J_j - y_j C_j) with y_j and v_j (rows x dofs) held: x_bar += Hess(C_j) v_j, p_bar += v_j . dJ_j/dp - y_j dC_j/dp. For kinds without a
// reverse of their own.
template <class K, class T>
void gradients_vjp(const T* x, const T* p, const T* y, const T* v, T* x_bar, T* p_bar) {
  constexpr int inside = inside_count<K>, last = (K::rows - 1) * K::dofs;
  using D = Dual<T, K::rows + inside>;
  D at[K::dofs], with[parameter_count<K> + 1], C[K::rows], J[K::rows * K::dofs];
  for (int d = 0; d < K::dofs; ++d) {
    at[d].v = x[d];
    for (int j = 0; j < K::rows; ++j) at[d].d[j] = times_factor<K>(p, j, v[j * K::dofs + d]);
  }
  load_inside<K>(p, with);
  for (int k = 0; k < inside; ++k) with[K::factors + k].d[K::rows + k] = T(1.0);
  evaluate_on_duals<K, K::rows + inside>(at, with, C, J);
  for (int j = 0; j < K::rows; ++j) {
    for (int d = 0; d < K::dofs; ++d) x_bar[d] += J[j * K::dofs + d].d[j];
    for (int k = 0; k < inside; ++k) {
      T sum = -(times_factor<K>(p, j, y[j]) * C[j].d[K::rows + k]);
      for (int d = 0; d < K::dofs; ++d) sum += at[d].d[j] * J[j * K::dofs + d].d[K::rows + k];
      p_bar[K::factors + k] += sum;
    }
    if (j < K::offsets) p_bar[K::factors + inside + j] += y[j];
  }
  if constexpr (K::factors) {
    T sum = -(y[K::rows - 1] * C[K::rows - 1].v);
    for (int d = 0; d < K::dofs; ++d) sum += v[last + d] * J[last + d].v;
    p_bar[0] += sum;
  }
}

// The references of damped angles on the branch next to what the constraint is at x.
template <class K, class T>
const T* on_branch(const T* x, const T* p, const T* C_r, T* out) {
  const Evaluation<K, T> at(x, p);
  for (int j = 0; j < K::rows; ++j) out[j] = at.C[j] - difference<K>(at.C[j], C_r[j]);
  return out;
}

}  // namespace sheetbend
