// C of one constraint and its gradient J, as an array or in the constraint's own factors (concept.h), and what a projection makes of J.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/unrolled.h"

namespace sheetbend {

// out = J^T y, on the stencil.
template <class K, class T>
void transpose_times(const T* J, const T* y, T* out) {
  unrolled<K::dofs>([&](int d) {
    out[d] = J[d] * y[0];
    for (int j = 1; j < K::rows; ++j) out[d] += J[j * K::dofs + d] * y[j];
  });
}

template <class K, class T>
struct DenseGradient {
  T J[K::rows * K::dofs];

  // A = J W J^T, lower triangle, row-major.
  void matrix(const T* w, T* A) const {
    unrolled<K::rows>([&](int i) {
      for (int j = 0; j <= i; ++j) {
        T sum = w[0] * dot(Vec3<T>(J + i * K::dofs), Vec3<T>(J + j * K::dofs));
        for (int k = 1; k < K::arity; ++k)
          sum += w[k] * dot(Vec3<T>(J + i * K::dofs + 3 * k), Vec3<T>(J + j * K::dofs + 3 * k));
        A[i * K::rows + j] = sum;
      }
    });
  }
  // y += J v.
  void add_times(const T* v, T* y) const {
    for (int j = 0; j < K::rows; ++j)
      for (int d = 0; d < K::dofs; ++d) y[j] += J[j * K::dofs + d] * v[d];
  }
  // out = J^T y.
  void transpose_times(const T* y, T* out) const { sheetbend::transpose_times<K>(J, y, out); }
};

template <class K, class T>
struct Linearization : DenseGradient<K, T> {
  T C[K::rows];
  Linearization(const T* x, const T* p) { K::evaluate(x, p, C, this->J); }
  void keep(const T* x, T* to) const { std::copy_n(x, K::dofs, to); }
  const Linearization& gradient() const { return *this; }
};
template <HasFactors K, class T>
struct Linearization<K, T> : K::template Factors<T> {
  using K::template Factors<T>::Factors;
  void keep(const T* x, T* to) const { std::copy_n(x, K::dofs, to); }
  const Linearization& gradient() const { return *this; }
};
template <HasGeometry K, class T>
struct Linearization<K, T> {
  Kept<K, T> at;
  T C[K::rows];
  Linearization(const T* x, const T* p) : at(x) { at.values(p, C); }
  void keep(const T*, T* to) const { at.keep(to); }
  DenseGradient<K, T> gradient() const {
    DenseGradient<K, T> dense;
    at.gradient(dense.J);
    return dense;
  }
};

// J where a projection was linearized, from what it left.
template <class K, class T>
auto gradient_of(const Kept<K, T>& at, const T* p) {
  if constexpr (HasGeometry<K>) {
    DenseGradient<K, T> gradient;
    at.gradient(gradient.J);
    return gradient;
  } else {
    return Linearization<K, T>(at.x, p);
  }
}

}  // namespace sheetbend
