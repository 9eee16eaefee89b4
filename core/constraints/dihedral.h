// dihedral: C = theta - rest, the angle between the two triangles of an edge  [rad]; see hinge_angle.h. Stencil x0, x1, a, b.
// For a sheet of bending stiffness B [N m]: alpha = (A_a + A_b)/(|e|^2 B)  [rad/(N m)] with the areas and the edge at rest. What a bent sheet
// then resists depends on the mesh: right on equilateral ones, between 0.83 and 1.33 times B on alternating diagonals, 1 to 3 times on one-way
// ones; sheet_curvature.h does not have this flaw. The angle is periodic.
#pragma once

#include "core/constraints/hinge_angle.h"

namespace sheetbend {

struct Dihedral : OnPoints<4> {
  static constexpr const char* name = "dihedral";
  static constexpr const char* about = "the angle between two triangles less a rest angle";
  static constexpr Unit unit = units::radians;
  static constexpr Compliance compliance{"(area + area) / (edge^2 B)"};
  static constexpr bool hot = true;
  static constexpr int rows = 1;
  static constexpr std::array parameters{Parameter{"rest", units::radians, ranges::any, defaults::usually(0.0)}};
  static constexpr int offsets = 1;
  static constexpr bool periodic = true;

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const HingeAngle<T> angle(Vec3<T>(x), Vec3<T>(x + 3), Vec3<T>(x + 6), Vec3<T>(x + 9));
    C[0] = difference<Dihedral>(angle.value, p[0]);
    angle.by_x0.store(J);
    angle.by_x1.store(J + 3);
    angle.by_a.store(J + 6);
    angle.by_b.store(J + 9);
  }

  template <class T>
  static void add_hessian(const T* x, const T*, const T* lambda, T* H) {
    constexpr int nodes[] = {0, 1, 2, 3};
    add_angle_hessian(x, nodes, lambda[0], H);
  }
};

}  // namespace sheetbend
