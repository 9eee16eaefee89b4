// The Green strain of a triangle, E = (F^T F - 1)/2 with F = sum x_k (dN_k/du, dN_k/dv) in its material axes u (warp) and v (weft), and the rows that
// carry an orthotropic membrane's energy. With a law f per component (f = strain for the linear one), its tension against the strain at rest
// stiffness k being k f f':
//
//   C1 = f(E_uu)    C2 = (n f(E_uu) + weft f(E_vv)) / sqrt(1 - n^2)    C3 = shear f(2 E_uv)        weft = sqrt(Y_v/Y_u), shear = sqrt(G/Y_u)
//
// and alpha = 1/(A Y_u) give A/2 of Y_u f(E_uu)^2 + 2 n sqrt(Y_u Y_v) f(E_uu) f(E_vv) + Y_v f(E_vv)^2, over 1 - n^2, + G f(2 E_uv)^2: for the linear law
// St. Venant-Kirchhoff in plane stress (Bonet & Wood 2008, ch. 6). n = sqrt(nu_uv nu_vu), between -1 and 1, is the Poisson coupling: the energy is
// positive definite for all of them. Three rows with one compliance are the constraint with a 3 x 3 compliance matrix, factored.
// Degenerate: only where a law is; a triangle without area at present has finite strain.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

// What a law makes of a strain: f and its slope.
template <class T>
struct Stretched {
  T f, slope;
};

// Law: `coefficients` per component, and template <class T> static Stretched<T> apply(const T& strain, const T* coefficients).
template <class Law>
struct Membrane : OnPoints<3> {
  static constexpr int rows = 3;

  // p: dN_1/du, dN_1/dv, dN_2/du, dN_2/dv [1/m], coupling n, weft, shear, and the law's coefficients of u, v and shear.
  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const Vec3<T> e1 = Vec3<T>(x + 3) - Vec3<T>(x), e2 = Vec3<T>(x + 6) - Vec3<T>(x);
    const Vec3<T> F_u = p[0] * e1 + p[2] * e2, F_v = p[1] * e1 + p[3] * e2;
    const T half(0.5), one(1.0);
    const T* coefficients = p + 7;
    const Stretched<T> u = Law::apply(half * (dot(F_u, F_u) - one), coefficients);
    const Stretched<T> v = Law::apply(half * (dot(F_v, F_v) - one), coefficients + Law::coefficients);
    const Stretched<T> shear = Law::apply(dot(F_u, F_v), coefficients + 2 * Law::coefficients);
    const T scale = one / sqrt(one - p[4] * p[4]), by_u = p[4] * scale, by_v = p[5] * scale;
    C[0] = u.f;
    C[1] = by_u * u.f + by_v * v.f;
    C[2] = p[6] * shear.f;

    const Vec3<T> along_u = u.slope * F_u, along_v = (by_v * v.slope) * F_v;
    const Vec3<T> across_u = (p[6] * shear.slope) * F_u, across_v = (p[6] * shear.slope) * F_v;
    for (int k = 1; k < 3; ++k) {
      const T &N_u = p[2 * k - 2], &N_v = p[2 * k - 1];
      const Vec3<T> first = N_u * along_u;
      first.store(J + 3 * k);
      (by_u * first + N_v * along_v).store(J + dofs + 3 * k);
      (N_u * across_v + N_v * across_u).store(J + 2 * dofs + 3 * k);
    }
    for (int d = 0; d < rows * dofs; d += dofs)
      for (int c = d; c < d + 3; ++c) J[c] = -(J[c + 3] + J[c + 6]);
  }
};

}  // namespace sheetbend
