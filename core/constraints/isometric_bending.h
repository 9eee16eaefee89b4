// isometric_bending: C = c1 (x1 - x0) + ca (a - x0) + cb (b - x0), the vector of quadratic bending for sheets that are flat at rest and keep their
// lengths (Bergou et al. 2006): of an edge x0x1 between two triangles, c = K/sqrt(A_a + A_b) with K the sums of cotangents at rest. Its gradient is
// constant. C, and not the quadratic energy C^2, is the constraint; with alpha = 1/B [1/(N m)] the energy is B |C|^2/2, near the flat
// shape that of `dihedral`. Stencil as there. Nothing is degenerate.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

struct IsometricBending : OnPoints<4> {
  static constexpr const char* name = "isometric_bending";
  static constexpr const char* about = "the mean curvature of a flat sheet at an edge, quadratic in the positions";
  static constexpr Unit unit = units::none;
  static constexpr Compliance compliance{"1 / B"};
  static constexpr bool hot = true;
  static constexpr int rows = 3;
  static constexpr std::array parameters{Parameter{"c1", units::per_meter, ranges::any, defaults::given},
                                         Parameter{"ca", units::per_meter, ranges::any, defaults::given},
                                         Parameter{"cb", units::per_meter, ranges::any, defaults::given}};

  // J is c_k times the unit matrix.
  template <class T>
  struct Factors {
    T C[rows], c[arity];
    Factors(const T* x, const T* p) : c{-(p[0] + p[1] + p[2]), p[0], p[1], p[2]} {
      Vec3<T> sum;
      for (int k = 1; k < arity; ++k) sum = sum + c[k] * (Vec3<T>(x + 3 * k) - Vec3<T>(x));
      sum.store(C);
    }
    void gradient(T* J) const {
      for (int i = 0; i < rows; ++i)
        for (int d = 0; d < dofs; ++d) J[i * dofs + d] = d % 3 == i ? c[d / 3] : T(0.0);
    }
    void matrix(const T* w, T* A) const {
      T sum = w[0] * (c[0] * c[0]);
      for (int k = 1; k < arity; ++k) sum += w[k] * (c[k] * c[k]);
      for (int i = 0; i < rows; ++i)
        for (int j = 0; j <= i; ++j) A[i * rows + j] = i == j ? sum : T(0.0);
    }
    void add_times(const T* v, T* y) const {
      for (int d = 0; d < dofs; ++d) y[d % 3] += c[d / 3] * v[d];
    }
    void transpose_times(const T* y, T* out) const {
      for (int d = 0; d < dofs; ++d) out[d] = c[d / 3] * y[d % 3];
    }
  };

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const Factors<T> at(x, p);
    std::copy_n(at.C, rows, C);
    at.gradient(J);
  }

  // C is bilinear in x and p, and J does not know x.
  template <class T>
  static void reverse(const T* x, const T*, const T* dl, const T* y, const T* a, const T* b, T*, T* p_bar) {
    for (int k = 1; k < arity; ++k)
      for (int j = 0; j < rows; ++j) {
        const int d = 3 * k + j;
        p_bar[k - 1] += dl[j] * (a[d] - a[j]) - y[j] * (b[d] - b[j] + x[d] - x[j]);
      }
  }

  template <class T>
  static void add_hessian(const T*, const T*, const T*, T*) {}
};

}  // namespace sheetbend
