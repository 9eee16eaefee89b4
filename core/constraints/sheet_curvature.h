// sheet_curvature: C = (kappa_uu, weft kappa_vv, twist kappa_uv), the curvature of a triangle in its material axes  [1/m], from the angles to its
// three neighbors: kappa = G (theta - rest), with the 3 x 3 matrix G that is exact for every quadratic surface through the six points near the flat
// rest shape. Stencil: the triangle x0, x1, x2, then the neighbors' vertices across x0x1, x1x2, x2x0.
// With weft = sqrt(B_weft/B_warp), twist = sqrt(2 B_twist/B_warp) and alpha = 1/(A B_warp) [1/(N m^3)] the energy is
//   A/2 (B_warp kappa_uu^2 + B_weft kappa_vv^2 + 2 B_twist kappa_uv^2),
// that of a plate without Poisson's effect where the three are equal. On meshes whose inner vertices have six neighbors a bent sheet resists with
// these numbers in every direction, one-way diagonals included (docs/decisions.md); the element of Onate & Zarate (2000) is near it.
// Degenerate: a triangle without area, an angle of half a turn.
#pragma once

#include "core/constraints/hinge_angle.h"
#include "core/scalar/dual.h"

namespace sheetbend {

struct SheetCurvature : OnPoints<6> {
  static constexpr const char* name = "sheet_curvature";
  static constexpr int rows = 3;
  static constexpr std::array<const char*, 14> parameters{"uu_0",  "uu_1",   "uu_2",   "vv_0",  "vv_1",
                                                          "vv_2",  "uv_0",   "uv_1",   "uv_2",  "weft",
                                                          "twist", "rest_0", "rest_1", "rest_2"};

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const T scale[rows] = {T(1.0), p[9], p[10]};
    for (int j = 0; j < rows; ++j) C[j] = T(0.0);
    for (int i = 0; i < rows * dofs; ++i) J[i] = T(0.0);
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3, top = (k + 2) % 3;
      const auto at = [&](int node) { return Vec3<T>(x + 3 * node); };
      const HingeAngle<T> angle(at(k), at(next), at(top), at(3 + k));
      for (int j = 0; j < rows; ++j) {
        const T factor = scale[j] * p[3 * j + k];
        C[j] += factor * (angle.value - p[11 + k]);
        (factor * angle.by_x0).add_to(J + j * dofs + 3 * k);
        (factor * angle.by_x1).add_to(J + j * dofs + 3 * next);
        (factor * angle.by_a).add_to(J + j * dofs + 3 * top);
        (factor * angle.by_b).add_to(J + j * dofs + 3 * (3 + k));
      }
    }
  }

  // Of v_j . J_j - y_j C_j, summed over rows, angle by angle: a direction reaches an angle with its row's factor.
  template <class T>
  static void reverse(const T* x, const T* p, const T* y, const T* v, T* x_bar, T* p_bar) {
    const T scale[rows] = {T(1.0), p[9], p[10]};
    for (int k = 0; k < 3; ++k) {
      const int nodes[4] = {k, (k + 1) % 3, (k + 2) % 3, 3 + k};
      T factor[rows], Y(0.0);
      for (int j = 0; j < rows; ++j) {
        factor[j] = scale[j] * p[3 * j + k];
        Y += factor[j] * y[j];
      }
      Dual<T> at[12], by[12];
      for (int i = 0; i < 12; ++i) {
        const int d = 3 * nodes[i / 3] + i % 3;
        at[i].v = x[d];
        at[i].d[0] = factor[0] * v[d] + factor[1] * v[dofs + d] + factor[2] * v[2 * dofs + d];
      }
      using Vec = Vec3<Dual<T>>;
      const HingeAngle<Dual<T>> angle(Vec(at), Vec(at + 3), Vec(at + 6), Vec(at + 9));
      angle.by_x0.store(by);
      angle.by_x1.store(by + 3);
      angle.by_a.store(by + 6);
      angle.by_b.store(by + 9);
      T along[rows]{};
      for (int i = 0; i < 12; ++i) {
        const int d = 3 * nodes[i / 3] + i % 3;
        x_bar[d] += by[i].d[0];
        for (int j = 0; j < rows; ++j) along[j] += by[i].v * v[j * dofs + d];
      }
      const T turned = angle.value.v - p[11 + k];
      for (int j = 0; j < rows; ++j) {
        const T factor_bar = along[j] - y[j] * turned;
        p_bar[3 * j + k] += scale[j] * factor_bar;
        if (j > 0) p_bar[8 + j] += p[3 * j + k] * factor_bar;
      }
      p_bar[11 + k] += Y;
    }
  }

  template <class T>
  static void add_hessian(const T* x, const T* p, const T* lambda, T* H) {
    for (int k = 0; k < 3; ++k) {
      const int nodes[] = {k, (k + 1) % 3, (k + 2) % 3, 3 + k};
      const T pull = p[k] * lambda[0] + p[9] * p[3 + k] * lambda[1] + p[10] * p[6 + k] * lambda[2];
      add_angle_hessian(x, nodes, pull, H);
    }
  }
};

}  // namespace sheetbend
