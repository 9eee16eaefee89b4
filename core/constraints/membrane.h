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
#include "core/scalar/dual.h"
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

  // Of v_j . J_j - y_j C_j, summed over rows, as a sum over components c of slope_c D_c - Y_c f_c: D_c is the derivative of the strain along the
  // directions that reach it, each with its row's factor, and Y_c the same of y.
  template <class T>
  static void reverse(const T* x, const T* p, const T* y, const T* v, T* x_bar, T* p_bar) {
    const T half(0.5), one(1.0);
    const T scale = one / sqrt(one - p[4] * p[4]), by_u = p[4] * scale, by_v = p[5] * scale;
    const auto edge = [](const T* of, int k) { return Vec3<T>(of + 3 * k) - Vec3<T>(of); };
    const Vec3<T> e1 = edge(x, 1), e2 = edge(x, 2), second1 = edge(v + dofs, 1), second2 = edge(v + dofs, 2);
    const Vec3<T> u1 = edge(v, 1) + by_u * second1, u2 = edge(v, 2) + by_u * second2;    // reaches E_uu
    const Vec3<T> v1 = by_v * second1, v2 = by_v * second2;                              // E_vv
    const Vec3<T> s1 = p[6] * edge(v + 2 * dofs, 1), s2 = p[6] * edge(v + 2 * dofs, 2);  // 2 E_uv
    const auto along_u = [&](const Vec3<T>& a, const Vec3<T>& b) { return p[0] * a + p[2] * b; };
    const auto along_v = [&](const Vec3<T>& a, const Vec3<T>& b) { return p[1] * a + p[3] * b; };
    const Vec3<T> F_u = along_u(e1, e2), F_v = along_v(e1, e2);
    const Vec3<T> u_u = along_u(u1, u2), v_v = along_v(v1, v2), s_u = along_u(s1, s2), s_v = along_v(s1, s2);
    const T D_u = dot(F_u, u_u), D_v = dot(F_v, v_v), D_s = dot(F_u, s_v) + dot(F_v, s_u);
    const T Y_u = y[0] + by_u * y[1], Y_v = by_v * y[1], Y_s = p[6] * y[2];
    const Component<T> u(half * (dot(F_u, F_u) - one), p + 7, Y_u, D_u, p_bar + 7);
    const Component<T> w(half * (dot(F_v, F_v) - one), p + 7 + coefficients, Y_v, D_v, p_bar + 7 + coefficients);
    const Component<T> s(dot(F_u, F_v), p + 7 + 2 * coefficients, Y_s, D_s, p_bar + 7 + 2 * coefficients);

    // J's x: through F at the strains, and through the derivatives D
    const Vec3<T> across_u = u.slope * u_u + s.slope * s_v, across_v = w.slope * v_v + s.slope * s_u;
    Vec3<T> F_u_bar = across_u + u.strain_bar * F_u + s.strain_bar * F_v;
    Vec3<T> F_v_bar = across_v + w.strain_bar * F_v + s.strain_bar * F_u;
    const Vec3<T> x1_bar = p[0] * F_u_bar + p[1] * F_v_bar, x2_bar = p[2] * F_u_bar + p[3] * F_v_bar;
    (-(x1_bar + x2_bar)).add_to(x_bar);
    x1_bar.add_to(x_bar + 3);
    x2_bar.add_to(x_bar + 6);

    const T pull_s = Y_s * s.slope;
    F_u_bar = F_u_bar - (Y_u * u.slope) * F_u - pull_s * F_v;
    F_v_bar = F_v_bar - (Y_v * w.slope) * F_v - pull_s * F_u;
    p_bar[0] += dot(e1, F_u_bar) + u.slope * dot(u1, F_u) + s.slope * dot(s1, F_v);
    p_bar[1] += dot(e1, F_v_bar) + w.slope * dot(v1, F_v) + s.slope * dot(s1, F_u);
    p_bar[2] += dot(e2, F_u_bar) + u.slope * dot(u2, F_u) + s.slope * dot(s2, F_v);
    p_bar[3] += dot(e2, F_v_bar) + w.slope * dot(v2, F_v) + s.slope * dot(s2, F_u);
    const T by_u_bar = u.slope * dot(F_u, along_u(second1, second2)) - y[1] * u.f;
    const T by_v_bar = w.slope * dot(F_v, along_v(second1, second2)) - y[1] * w.f;
    const T cube = scale * scale * scale;
    p_bar[4] += cube * (by_u_bar + p[4] * p[5] * by_v_bar);
    p_bar[5] += scale * by_v_bar;
    const Vec3<T> third1 = edge(v + 2 * dofs, 1), third2 = edge(v + 2 * dofs, 2);
    p_bar[6] += s.slope * (dot(F_u, along_v(third1, third2)) + dot(F_v, along_u(third1, third2))) - y[2] * s.f;
  }

  // Of a component c that the rows pull at with L_c: L_c (f'' g g^T + f' Hess(strain)), g being the strain's gradient.
  template <class T>
  static void add_hessian(const T* x, const T* p, const T* lambda, T* H) {
    const T half(0.5), one(1.0);
    const T scale = one / sqrt(one - p[4] * p[4]), by_u = p[4] * scale, by_v = p[5] * scale;
    const T N_u[3] = {-(p[0] + p[2]), p[0], p[2]}, N_v[3] = {-(p[1] + p[3]), p[1], p[3]};
    const Vec3<T> e1 = Vec3<T>(x + 3) - Vec3<T>(x), e2 = Vec3<T>(x + 6) - Vec3<T>(x);
    const Vec3<T> F_u = p[0] * e1 + p[2] * e2, F_v = p[1] * e1 + p[3] * e2;
    const Bent<T> u(half * (dot(F_u, F_u) - one), p + 7, lambda[0] + by_u * lambda[1]);
    const Bent<T> v(half * (dot(F_v, F_v) - one), p + 7 + coefficients, by_v * lambda[1]);
    const Bent<T> shear(dot(F_u, F_v), p + 7 + 2 * coefficients, p[6] * lambda[2]);
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k <= i; ++k) {
        const T same =
            u.slope * N_u[i] * N_u[k] + v.slope * N_v[i] * N_v[k] + shear.slope * (N_u[i] * N_v[k] + N_v[i] * N_u[k]);
        for (int a = 0; a < 3; ++a) H[triangle(3 * i + a) + 3 * k + a] += same;
      }
    if constexpr (coefficients > 0) {  // without them the law is a line
      T g_u[dofs], g_v[dofs], g_s[dofs];
      for (int k = 0; k < 3; ++k) {
        (N_u[k] * F_u).store(g_u + 3 * k);
        (N_v[k] * F_v).store(g_v + 3 * k);
        (N_u[k] * F_v + N_v[k] * F_u).store(g_s + 3 * k);
      }
      for (int a = 0; a < dofs; ++a) {
        const T of_u = u.curvature * g_u[a], of_v = v.curvature * g_v[a], of_s = shear.curvature * g_s[a];
        for (int b = 0; b <= a; ++b) H[triangle(a) + b] += of_u * g_u[b] + of_v * g_v[b] + of_s * g_s[b];
      }
    }
  }

 private:
  static constexpr int coefficients = Law::coefficients;

  // f' and f'' of one component, times what pulls at it.
  template <class T>
  struct Bent {
    T slope, curvature;
    Bent(const T& strain, const T* of_law, const T& pull) {
      Dual<T> at(strain), with[coefficients + 1];
      at.d[0] = T(1.0);
      for (int k = 0; k < coefficients; ++k) with[k].v = of_law[k];
      const Stretched<Dual<T>> law = Law::apply(at, with);
      slope = pull * law.slope.v;
      curvature = pull * law.slope.d[0];
    }
  };

  // slope D - Y f of one component: strain_bar is its derivative by the strain in the slope, and the coefficients get theirs.
  template <class T>
  struct Component {
    T f, slope, strain_bar;
    Component(const T& strain, const T* of_law, const T& Y, const T& D, T* coefficients_bar) {
      using Along = Dual<T, 1 + coefficients>;
      Along at(strain), with[coefficients + 1];
      at.d[0] = T(1.0);
      for (int k = 0; k < coefficients; ++k) {
        with[k].v = of_law[k];
        with[k].d[1 + k] = T(1.0);
      }
      const Stretched<Along> law = Law::apply(at, with);
      f = law.f.v;
      slope = law.slope.v;
      strain_bar = D * law.slope.d[0];
      for (int k = 0; k < coefficients; ++k) coefficients_bar[k] += D * law.slope.d[1 + k] - Y * law.f.d[1 + k];
    }
  };
};

}  // namespace sheetbend
