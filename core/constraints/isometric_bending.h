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
  static constexpr int rows = 3;
  static constexpr std::array<const char*, 3> parameters{"c1", "ca", "cb"};

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const T c[arity] = {-(p[0] + p[1] + p[2]), p[0], p[1], p[2]};
    Vec3<T> sum;
    for (int k = 1; k < arity; ++k) sum = sum + c[k] * (Vec3<T>(x + 3 * k) - Vec3<T>(x));
    sum.store(C);
    for (int i = 0; i < rows; ++i)
      for (int d = 0; d < dofs; ++d) J[i * dofs + d] = d % 3 == i ? c[d / 3] : T(0.0);
  }

  // C is bilinear in x and p, and J does not know x.
  template <class T>
  static void reverse(const T* x, const T*, const T* y, const T* v, T*, T* p_bar) {
    for (int k = 1; k < arity; ++k)
      for (int j = 0; j < rows; ++j) {
        const T* along = v + j * dofs + j;
        p_bar[k - 1] += along[3 * k] - along[0] - y[j] * (x[3 * k + j] - x[j]);
      }
  }

  template <class T>
  static void add_hessian(const T*, const T*, const T*, T*) {}
};

}  // namespace sheetbend
