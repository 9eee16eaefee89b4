// rigid: what makes four nodes a rigid body. Three axes a1, a2, a3 stay orthonormal,
//
//   C = ((a1.a1 - 1)/2, (a2.a2 - 1)/2, (a3.a3 - 1)/2, a2.a3, a1.a3, a1.a2)   [-],
//
// the Green strain of the body, shears doubled. The stencil is the body's axes (core/scene/bodies.h), which have no unit of length; its center is no part
// of it (director formulation of rigid bodies: Betsch & Steinmann 2001). Compliance 0 is a rigid body; with a compliance alpha [1/(N m)] the body strains
// uniformly and stores |C|^2/(2 alpha).
// Degenerate: axes in one plane have dependent gradients.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

struct Rigid : OnPoints<3> {
  static constexpr const char* name = "rigid";
  static constexpr const char* about = "the strain of a body's three axes, which makes it rigid";
  static constexpr Unit unit = units::none;
  static constexpr Compliance compliance{"1 / (stiffness volume), usually 0"};
  static constexpr int points = 0, axes = 3;
  static constexpr int rows = 6;
  static constexpr std::array<Parameter, 0> parameters{};

  // Row j pulls axis first[j] along axis second[j] and the other way round.
  static constexpr int first[rows] = {0, 1, 2, 1, 0, 0}, second[rows] = {0, 1, 2, 2, 2, 1};

  template <class T>
  struct Factors {
    T C[rows];
    Vec3<T> a[3];

    Factors(const T* x, const T*) {
      for (int k = 0; k < 3; ++k) a[k] = Vec3<T>(x + 3 * k);
      for (int j = 0; j < 3; ++j) C[j] = T(0.5) * (dot(a[j], a[j]) - T(1.0));
      for (int j = 3; j < rows; ++j) C[j] = dot(a[first[j]], a[second[j]]);
    }
    void gradient(T* J) const {
      for (int d = 0; d < rows * dofs; ++d) J[d] = T(0.0);
      for (int j = 0; j < rows; ++j) {
        a[first[j]].store(J + j * dofs + 3 * second[j]);
        a[second[j]].store(J + j * dofs + 3 * first[j]);
      }
    }
    void matrix(const T* w, T* A) const {
      const T zero(0.0);
      T aa[3];
      for (int k = 0; k < 3; ++k) aa[k] = dot(a[k], a[k]);
      for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < j; ++i) A[j * rows + i] = zero;
        A[j * rows + j] = w[j] * aa[j];
      }
      for (int j = 3; j < rows; ++j) {
        const int p = first[j], q = second[j], r = 3 - p - q;
        A[j * rows + p] = w[p] * C[j];
        A[j * rows + q] = w[q] * C[j];
        A[j * rows + r] = zero;
        A[j * rows + j] = w[p] * aa[q] + w[q] * aa[p];
      }
      A[4 * rows + 3] = w[2] * C[5];
      A[5 * rows + 3] = w[1] * C[4];
      A[5 * rows + 4] = w[0] * C[3];
    }
    void add_times(const T* v, T* y) const {
      for (int j = 0; j < 3; ++j) y[j] += dot(a[j], Vec3<T>(v + 3 * j));
      for (int j = 3; j < rows; ++j)
        y[j] += dot(a[first[j]], Vec3<T>(v + 3 * second[j])) + dot(a[second[j]], Vec3<T>(v + 3 * first[j]));
    }
    void transpose_times(const T* y, T* out) const {
      for (int k = 0; k < 3; ++k) (y[k] * a[k]).store(out + 3 * k);
      for (int j = 3; j < rows; ++j) {
        (y[j] * a[second[j]]).add_to(out + 3 * first[j]);
        (y[j] * a[first[j]]).add_to(out + 3 * second[j]);
      }
    }
  };

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const Factors<T> at(x, p);
    std::copy_n(at.C, rows, C);
    at.gradient(J);
  }

  // Hess(C_j) exchanges the row's two axes.
  template <class T>
  static void reverse(const T*, const T*, const T* dl, const T* y, const T* a, const T* b, T* x_bar, T*) {
    const auto along = [&](int j, int k) { return dl[j] * Vec3<T>(a + 3 * k) - y[j] * Vec3<T>(b + 3 * k); };
    for (int j = 0; j < 3; ++j) along(j, j).add_to(x_bar + 3 * j);
    for (int j = 3; j < rows; ++j) {
      along(j, second[j]).add_to(x_bar + 3 * first[j]);
      along(j, first[j]).add_to(x_bar + 3 * second[j]);
    }
  }

  template <class T>
  static void add_hessian(const T*, const T*, const T* lambda, T* H) {
    for (int j = 0; j < rows; ++j)
      for (int d = 0; d < 3; ++d) H[triangle(3 * second[j] + d) + 3 * first[j] + d] += lambda[j];
  }
};

}  // namespace sheetbend
