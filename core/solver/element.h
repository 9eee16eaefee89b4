// One constraint inside a substep: its local coordinates and weights, its coefficients, and the residual s of the block projection
//   a = alpha / eta^2,  g = alpha beta / eta,  s = C + a lambda + g (C - C_r)
// (XPBD, Macklin et al. 2016, eq. 18 and 26, with the damping by the constraint's own rate; eta is h for BDF1, 2h/3 for BDF2).
#pragma once

#include "core/constraints/registry.h"
#include "core/scene/scene.h"

namespace sheetbend {

// What one substep works on. Per-constraint arrays are in the scene's order, per-row arrays in the order of the multipliers.
template <class T>
struct SubstepState {
  const Scene& scene;
  Inputs<const T> inputs;
  double eta;
  T* q;          // coordinates, being corrected
  const T* w;    // effective inverse mass per node; 0 for pinned and driven
  const T* C_r;  // reference values of damped rows
  T* lambda;     // multipliers, reset at the substep's start
};

template <class T>
struct Rates {
  T a, g;
  Rates(const T& alpha, const T& beta, double eta) : a(alpha * T(1.0 / (eta * eta))), g(alpha * beta * T(1.0 / eta)) {}
};

template <class K, class T>
struct Element {
  const int* nodes;
  const T* p;
  Rates<T> rates;
  int first_row;
  T x[K::dofs], w[K::arity];

  Element(const SubstepState<T>& s, const Group& group, int item) : Element(s, group, item, nullptr) {}

  // With the coordinates given (from a record) instead of gathered.
  Element(const SubstepState<T>& s, const Group& group, int item, const T* recorded)
      : nodes(group.stencil.data() + static_cast<std::size_t>(item) * K::arity),
        p(s.inputs.of(Quantity::rest) + group.first_value + static_cast<std::size_t>(item) * parameter_count<K>),
        rates(s.inputs.of(Quantity::compliance)[group.first + item],
              group.damped ? s.inputs.of(Quantity::damping)[group.first + item] : T(0.0), s.eta),
        first_row(group.first_row + item * K::rows) {
    for (int k = 0; k < K::arity; ++k) {
      w[k] = s.w[nodes[k]];
      const T* from = recorded ? recorded + 3 * k : s.q + s.scene.first_dof[nodes[k]];
      for (int d = 0; d < 3; ++d) x[3 * k + d] = from[d];
    }
  }

  T residual(const SubstepState<T>& s, bool damped, const T* C, int row) const {
    T r = C[row] + rates.a * s.lambda[first_row + row];
    if (damped) r += rates.g * difference<K>(C[row], s.C_r[first_row + row]);
    return r;
  }

  // A = J W J^T + a/(1+g), lower triangle, row-major.
  void matrix(const T* J, T* A) const {
    for (int i = 0; i < K::rows; ++i)
      for (int j = 0; j <= i; ++j) {
        T sum(0.0);
        for (int k = 0; k < K::arity; ++k) {
          T product(0.0);
          for (int d = 0; d < 3; ++d) product += J[i * K::dofs + 3 * k + d] * J[j * K::dofs + 3 * k + d];
          sum += w[k] * product;
        }
        A[i * K::rows + j] = i == j ? sum + rates.a / (T(1.0) + rates.g) : sum;
      }
  }
};

// out += J^T y, on the stencil.
template <class K, class T>
void transpose_times(const T* J, const T* y, T* out) {
  for (int d = 0; d < K::dofs; ++d) {
    T sum = J[d] * y[0];
    for (int j = 1; j < K::rows; ++j) sum += J[j * K::dofs + d] * y[j];
    out[d] += sum;
  }
}

}  // namespace sheetbend
