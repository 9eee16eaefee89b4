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

  // The gradients of the strains at particle k are N_u F_u, N_v F_v and N_u F_v + N_v F_u, so that J W J^T wants the sums of w N N and the
  // dot products of F_u and F_v alone, which the strains have.
  // p: dN_1/du, dN_1/dv, dN_2/du, dN_2/dv [1/m], coupling n, weft, shear, and the law's coefficients of u, v and shear.
  template <class T>
  struct Factors {
    T C[rows], N1_u, N1_v, N2_u, N2_v, by_u, slope_u, slope_v, slope_s, uu, uv, vv;
    Vec3<T> F_u, F_v;

    Factors(const T* x, const T* p) : N1_u(p[0]), N1_v(p[1]), N2_u(p[2]), N2_v(p[3]) {
      const Vec3<T> e1 = Vec3<T>(x + 3) - Vec3<T>(x), e2 = Vec3<T>(x + 6) - Vec3<T>(x);
      F_u = N1_u * e1 + N2_u * e2;
      F_v = N1_v * e1 + N2_v * e2;
      uu = dot(F_u, F_u);
      uv = dot(F_u, F_v);
      vv = dot(F_v, F_v);
      const T half(0.5), one(1.0), scale = one / sqrt(one - p[4] * p[4]), by_v = p[5] * scale;
      by_u = p[4] * scale;
      const T* of_law = p + 7;
      const Stretched<T> u = Law::apply(half * (uu - one), of_law);
      const Stretched<T> v = Law::apply(half * (vv - one), of_law + coefficients);
      const Stretched<T> s = Law::apply(uv, of_law + 2 * coefficients);
      C[0] = u.f;
      C[1] = by_u * u.f + by_v * v.f;
      C[2] = p[6] * s.f;
      slope_u = u.slope;
      slope_v = by_v * v.slope;
      slope_s = p[6] * s.slope;
    }
    void gradient(T* J) const {
      const Vec3<T> along_u = slope_u * F_u, along_v = slope_v * F_v, across_u = slope_s * F_u,
                    across_v = slope_s * F_v;
      for (int k = 1; k < 3; ++k) {
        const T &N_u = k == 1 ? N1_u : N2_u, &N_v = k == 1 ? N1_v : N2_v;
        const Vec3<T> first = N_u * along_u;
        first.store(J + 3 * k);
        (by_u * first + N_v * along_v).store(J + dofs + 3 * k);
        (N_u * across_v + N_v * across_u).store(J + 2 * dofs + 3 * k);
      }
      for (int d = 0; d < rows * dofs; d += dofs)
        for (int c = d; c < d + 3; ++c) J[c] = -(J[c + 3] + J[c + 6]);
    }
    void matrix(const T* w, T* A) const {
      const T N0_u = N1_u + N2_u, N0_v = N1_v + N2_v, two(2.0);
      const T S_uu = w[0] * (N0_u * N0_u) + w[1] * (N1_u * N1_u) + w[2] * (N2_u * N2_u);
      const T S_uv = w[0] * (N0_u * N0_v) + w[1] * (N1_u * N1_v) + w[2] * (N2_u * N2_v);
      const T S_vv = w[0] * (N0_v * N0_v) + w[1] * (N1_v * N1_v) + w[2] * (N2_v * N2_v);
      const T across = S_uv * (slope_u * slope_v * uv), su = slope_s * slope_u, sv = slope_s * slope_v;
      A[0] = S_uu * (slope_u * slope_u * uu);
      A[3] = by_u * A[0] + across;
      A[4] = by_u * (A[3] + across) + S_vv * (slope_v * slope_v * vv);
      A[6] = su * (S_uu * uv + S_uv * uu);
      A[7] = by_u * A[6] + sv * (S_uv * vv + S_vv * uv);
      A[8] = slope_s * slope_s * (S_uu * vv + two * (S_uv * uv) + S_vv * uu);
    }
    void add_times(const T* v, T* y) const {
      const Vec3<T> v1 = Vec3<T>(v + 3) - Vec3<T>(v), v2 = Vec3<T>(v + 6) - Vec3<T>(v);
      const Vec3<T> D_u = N1_u * v1 + N2_u * v2, D_v = N1_v * v1 + N2_v * v2;
      const T along_u = slope_u * dot(F_u, D_u);
      y[0] += along_u;
      y[1] += by_u * along_u + slope_v * dot(F_v, D_v);
      y[2] += slope_s * (dot(F_v, D_u) + dot(F_u, D_v));
    }
    void transpose_times(const T* y, T* out) const {
      const T of_u = slope_u * (y[0] + by_u * y[1]), of_v = slope_v * y[1], of_s = slope_s * y[2];
      const Vec3<T> along_u = of_u * F_u + of_s * F_v, along_v = of_v * F_v + of_s * F_u;
      const Vec3<T> at1 = N1_u * along_u + N1_v * along_v, at2 = N2_u * along_u + N2_v * along_v;
      (-(at1 + at2)).store(out);
      at1.store(out + 3);
      at2.store(out + 6);
    }
  };

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const Factors<T> at(x, p);
    std::copy_n(at.C, rows, C);
    at.gradient(J);
  }

  // Of v_j . J_j - y_j C_j, summed over rows, as a sum over components c of slope_c D_c - Y_c f_c: D_c is the derivative of the strain along the
  // directions that reach it, X_c a - Y_c b.
  template <class T>
  static void reverse(const T* x, const T* p, const T* dl, const T* y, const T* a, const T* b, T* x_bar, T* p_bar) {
    const T half(0.5), one(1.0);
    const T scale = one / sqrt(one - p[4] * p[4]), by_u = p[4] * scale, by_v = p[5] * scale;
    const auto edge = [](const T* of, int k) { return Vec3<T>(of + 3 * k) - Vec3<T>(of); };
    const auto along_u = [&](const Vec3<T>& at1, const Vec3<T>& at2) { return p[0] * at1 + p[2] * at2; };
    const auto along_v = [&](const Vec3<T>& at1, const Vec3<T>& at2) { return p[1] * at1 + p[3] * at2; };
    const Vec3<T> e1 = edge(x, 1), e2 = edge(x, 2), a1 = edge(a, 1), a2 = edge(a, 2), b1 = edge(b, 1), b2 = edge(b, 2);
    const Vec3<T> F_u = along_u(e1, e2), F_v = along_v(e1, e2);
    const Vec3<T> A_u = along_u(a1, a2), A_v = along_v(a1, a2), B_u = along_u(b1, b2), B_v = along_v(b1, b2);
    const T a_u = dot(F_u, A_u), a_v = dot(F_v, A_v), a_s = dot(F_u, A_v) + dot(F_v, A_u);
    const T b_u = dot(F_u, B_u), b_v = dot(F_v, B_v), b_s = dot(F_u, B_v) + dot(F_v, B_u);
    const T X_u = dl[0] + by_u * dl[1], X_v = by_v * dl[1], X_s = p[6] * dl[2];
    const T Y_u = y[0] + by_u * y[1], Y_v = by_v * y[1], Y_s = p[6] * y[2];
    const Component<T> u(half * (dot(F_u, F_u) - one), p + 7, Y_u, X_u * a_u - Y_u * b_u, p_bar + 7);
    const Component<T> v(half * (dot(F_v, F_v) - one), p + 7 + coefficients, Y_v, X_v * a_v - Y_v * b_v,
                         p_bar + 7 + coefficients);
    const Component<T> s(dot(F_u, F_v), p + 7 + 2 * coefficients, Y_s, X_s * a_s - Y_s * b_s,
                         p_bar + 7 + 2 * coefficients);

    // J's x: through F at the strains, and through the derivatives D
    const T Xs_u = u.slope * X_u, Ys_u = u.slope * Y_u, Xs_v = v.slope * X_v, Ys_v = v.slope * Y_v;
    const T Xs_s = s.slope * X_s, Ys_s = s.slope * Y_s;
    Vec3<T> F_u_bar = Xs_u * A_u - Ys_u * B_u + Xs_s * A_v - Ys_s * B_v + u.strain_bar * F_u + s.strain_bar * F_v;
    Vec3<T> F_v_bar = Xs_v * A_v - Ys_v * B_v + Xs_s * A_u - Ys_s * B_u + v.strain_bar * F_v + s.strain_bar * F_u;
    const Vec3<T> x1_bar = p[0] * F_u_bar + p[1] * F_v_bar, x2_bar = p[2] * F_u_bar + p[3] * F_v_bar;
    (-(x1_bar + x2_bar)).add_to(x_bar);
    x1_bar.add_to(x_bar + 3);
    x2_bar.add_to(x_bar + 6);

    // the values' F, and the gradients' N
    const Vec3<T> of_u = Ys_u * F_u + Ys_s * F_v, of_v = Ys_v * F_v + Ys_s * F_u;
    const Vec3<T> to_u = Xs_u * F_u + Xs_s * F_v, to_v = Xs_v * F_v + Xs_s * F_u;
    F_u_bar = F_u_bar - of_u;
    F_v_bar = F_v_bar - of_v;
    p_bar[0] += dot(e1, F_u_bar) + dot(a1, to_u) - dot(b1, of_u);
    p_bar[1] += dot(e1, F_v_bar) + dot(a1, to_v) - dot(b1, of_v);
    p_bar[2] += dot(e2, F_u_bar) + dot(a2, to_u) - dot(b2, of_u);
    p_bar[3] += dot(e2, F_v_bar) + dot(a2, to_v) - dot(b2, of_v);
    const T by_u_bar = u.slope * (dl[1] * a_u - y[1] * b_u) - y[1] * u.f;
    const T by_v_bar = v.slope * (dl[1] * a_v - y[1] * b_v) - y[1] * v.f;
    const T cube = scale * scale * scale;
    p_bar[4] += cube * (by_u_bar + p[4] * p[5] * by_v_bar);
    p_bar[5] += scale * by_v_bar;
    p_bar[6] += s.slope * (dl[2] * a_s - y[2] * b_s) - y[2] * s.f;
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

  // slope D - Y f of one component: strain_bar is its derivative with respect to the strain in the slope, and the coefficients get theirs.
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
