// sheet_curvature: C = (kappa_uu, weft kappa_vv, twist kappa_uv), the curvature of a triangle in its material axes  [1/m], from the angles to its
// three neighbors: kappa = G (theta - rest), with the 3 x 3 matrix G that is exact for every quadratic surface through the six points near the flat
// rest shape. Stencil: the triangle x0, x1, x2, then the neighbors' vertices across x0x1, x1x2, x2x0.
// With weft = sqrt(B_weft/B_warp), twist = sqrt(2 B_twist/B_warp) and alpha = 1/(A B_warp) [1/(N m^3)] the energy is
//   A/2 (B_warp kappa_uu^2 + B_weft kappa_vv^2 + 2 B_twist kappa_uv^2),
// that of a plate without Poisson's effect where the three are equal. On meshes whose inner vertices have six neighbors a bent sheet resists with
// these numbers in every direction, one-way diagonals included (docs/decisions); the element of Onate & Zarate (2000) is near it.
// Degenerate: a triangle without area, an angle of half a turn.
#pragma once

#include "core/constraints/hinge_angle.h"
#include "core/scalar/dual.h"

namespace sheetbend {

struct SheetCurvature : OnPoints<6> {
  static constexpr const char* name = "sheet_curvature";
  static constexpr const char* about = "the curvatures of a triangle in its material axes less those at rest";
  static constexpr Unit unit = units::per_meter;
  static constexpr Compliance compliance{"1 / (area B_warp)", Compliance::matrix};
  static constexpr bool hot = true;
  static constexpr int rows = 3;
  static constexpr std::array parameters{Parameter{"uu_0", units::per_meter, ranges::any, defaults::given},
                                         Parameter{"uu_1", units::per_meter, ranges::any, defaults::given},
                                         Parameter{"uu_2", units::per_meter, ranges::any, defaults::given},
                                         Parameter{"vv_0", units::per_meter, ranges::any, defaults::given},
                                         Parameter{"vv_1", units::per_meter, ranges::any, defaults::given},
                                         Parameter{"vv_2", units::per_meter, ranges::any, defaults::given},
                                         Parameter{"uv_0", units::per_meter, ranges::any, defaults::given},
                                         Parameter{"uv_1", units::per_meter, ranges::any, defaults::given},
                                         Parameter{"uv_2", units::per_meter, ranges::any, defaults::given},
                                         Parameter{"weft", units::none, ranges::any, defaults::given},
                                         Parameter{"twist", units::none, ranges::any, defaults::given},
                                         Parameter{"rest_0", units::radians, ranges::any, defaults::given},
                                         Parameter{"rest_1", units::radians, ranges::any, defaults::given},
                                         Parameter{"rest_2", units::radians, ranges::any, defaults::given}};

  // J is the 3 x 3 matrix of `factor` times the gradients of the angles, each on four of the six particles.
  template <class T>
  struct Factors {
    T C[rows], factor[rows][3];
    T by[3][12];  // of an angle, at its own x0, x1, a, b

    Factors(const T* x, const T* p) {
      const T scale[rows] = {T(1.0), p[9], p[10]};
      for (int j = 0; j < rows; ++j) C[j] = T(0.0);
      for (int k = 0; k < 3; ++k) {
        const auto at = [&](int i) { return Vec3<T>(x + 3 * particle(k, i)); };
        const HingeAngle<T> angle(at(0), at(1), at(2), at(3));
        angle.by_x0.store(by[k]);
        angle.by_x1.store(by[k] + 3);
        angle.by_a.store(by[k] + 6);
        angle.by_b.store(by[k] + 9);
        for (int j = 0; j < rows; ++j) {
          factor[j][k] = scale[j] * p[3 * j + k];
          C[j] += factor[j][k] * (angle.value - p[11 + k]);
        }
      }
    }
    void gradient(T* J) const {
      for (int i = 0; i < rows * dofs; ++i) J[i] = T(0.0);
      for (int j = 0; j < rows; ++j)
        for (int k = 0; k < 3; ++k)
          for (int i = 0; i < 4; ++i) (factor[j][k] * by_own(k, i)).add_to(J + j * dofs + 3 * particle(k, i));
    }
    void matrix(const T* w, T* A) const {
      T of_angles[3][3];
      for (int k = 0; k < 3; ++k) {
        T sum = w[3 + k] * dot(by_own(k, 3), by_own(k, 3));
        for (int i = 0; i < 3; ++i) sum += w[i] * dot(by_corner(k, i), by_corner(k, i));
        of_angles[k][k] = sum;
        for (int l = 0; l < k; ++l) {
          T shared = w[0] * dot(by_corner(k, 0), by_corner(l, 0));
          for (int i = 1; i < 3; ++i) shared += w[i] * dot(by_corner(k, i), by_corner(l, i));
          of_angles[k][l] = of_angles[l][k] = shared;
        }
      }
      for (int i = 0; i < rows; ++i) {
        T times[3];
        for (int k = 0; k < 3; ++k)
          times[k] = factor[i][0] * of_angles[0][k] + factor[i][1] * of_angles[1][k] + factor[i][2] * of_angles[2][k];
        for (int j = 0; j <= i; ++j)
          A[i * rows + j] = times[0] * factor[j][0] + times[1] * factor[j][1] + times[2] * factor[j][2];
      }
    }
    void add_times(const T* v, T* y) const {
      for (int k = 0; k < 3; ++k) {
        T turn = dot(by_own(k, 0), Vec3<T>(v + 3 * particle(k, 0)));
        for (int i = 1; i < 4; ++i) turn += dot(by_own(k, i), Vec3<T>(v + 3 * particle(k, i)));
        for (int j = 0; j < rows; ++j) y[j] += factor[j][k] * turn;
      }
    }
    void transpose_times(const T* y, T* out) const {
      T turn[3];
      for (int k = 0; k < 3; ++k) turn[k] = factor[0][k] * y[0] + factor[1][k] * y[1] + factor[2][k] * y[2];
      for (int i = 0; i < 3; ++i) {
        (turn[0] * by_corner(0, i) + turn[1] * by_corner(1, i) + turn[2] * by_corner(2, i)).store(out + 3 * i);
        (turn[i] * by_own(i, 3)).store(out + 9 + 3 * i);
      }
    }

   private:
    Vec3<T> by_own(int k, int i) const { return Vec3<T>(by[k] + 3 * i); }
    Vec3<T> by_corner(int k, int corner) const { return by_own(k, (corner + 3 - k) % 3); }
  };

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const Factors<T> at(x, p);
    std::copy_n(at.C, rows, C);
    at.gradient(J);
  }

  // Of v_j . J_j - y_j C_j, summed over rows, angle by angle: a direction reaches an angle with its row's factor.
  template <class T>
  static void reverse(const T* x, const T* p, const T* dl, const T* y, const T* a, const T* b, T* x_bar, T* p_bar) {
    const T scale[rows] = {T(1.0), p[9], p[10]};
    for (int k = 0; k < 3; ++k) {
      T X(0.0), Y(0.0);
      for (int j = 0; j < rows; ++j) {
        const T factor = scale[j] * p[3 * j + k];
        X += factor * dl[j];
        Y += factor * y[j];
      }
      Dual<T> at[12], by[12];
      for (int i = 0; i < 12; ++i) {
        const int d = 3 * particle(k, i / 3) + i % 3;
        at[i].v = x[d];
        at[i].d[0] = X * a[d] - Y * b[d];
      }
      using Vec = Vec3<Dual<T>>;
      const HingeAngle<Dual<T>> angle(Vec(at), Vec(at + 3), Vec(at + 6), Vec(at + 9));
      angle.by_x0.store(by);
      angle.by_x1.store(by + 3);
      angle.by_a.store(by + 6);
      angle.by_b.store(by + 9);
      T along_a(0.0), along_b(0.0);
      for (int i = 0; i < 12; ++i) {
        const int d = 3 * particle(k, i / 3) + i % 3;
        x_bar[d] += by[i].d[0];
        along_a += by[i].v * a[d];
        along_b += by[i].v * b[d];
      }
      const T turned = along_b + (angle.value.v - p[11 + k]);
      for (int j = 0; j < rows; ++j) {
        const T factor_bar = dl[j] * along_a - y[j] * turned;
        p_bar[3 * j + k] += scale[j] * factor_bar;
        if (j > 0) p_bar[8 + j] += p[3 * j + k] * factor_bar;
      }
      p_bar[11 + k] += Y;
    }
  }

  template <class T>
  static void add_hessian(const T* x, const T* p, const T* lambda, T* H) {
    for (int k = 0; k < 3; ++k) {
      const int nodes[] = {particle(k, 0), particle(k, 1), particle(k, 2), particle(k, 3)};
      const T pull = p[k] * lambda[0] + p[9] * p[3 + k] * lambda[1] + p[10] * p[6 + k] * lambda[2];
      add_angle_hessian(x, nodes, pull, H);
    }
  }

 private:
  // Which of the six is angle k's x0, x1, a, b.
  static constexpr int particle(int k, int i) { return i < 3 ? (k + i) % 3 : 3 + k; }
};

}  // namespace sheetbend
