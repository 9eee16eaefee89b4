// hinge: C = theta - rest, the signed angle from edge x0x1 to edge x1x2 about a fixed unit normal  [rad].
// theta = atan2(n.(e1 x e2), e1.e2), never acos. Compliance in rad/(N m); with damping alone it is the viscous hinge whose torque is
// -c d(theta)/dt. The angle is periodic. Degenerate: an edge without length, or parallel to the normal.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

struct Hinge : OnPoints<3> {
  static constexpr const char* name = "hinge";
  static constexpr const char* about = "the angle between two edges about a fixed normal, less a rest angle";
  static constexpr Unit unit = units::radians;
  static constexpr Compliance compliance{"angle / torque"};
  static constexpr bool hot = true;
  static constexpr int rows = 1;
  static constexpr std::array parameters{Parameter{"normal_x", units::none, ranges::any, defaults::normal},
                                         Parameter{"normal_y", units::none, ranges::any, defaults::normal},
                                         Parameter{"normal_z", units::none, ranges::any, defaults::normal},
                                         Parameter{"rest", units::radians, ranges::any, defaults::usually(0.0)}};
  static constexpr bool periodic = true;

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const Vec3<T> e1 = Vec3<T>(x + 3) - Vec3<T>(x), e2 = Vec3<T>(x + 6) - Vec3<T>(x + 3), normal(p);
    const T s = dot(normal, cross(e1, e2)), c = dot(e1, e2);
    const T inverse = T(1.0) / (s * s + c * c);
    C[0] = difference<Hinge>(atan2(s, c), p[3]);
    const Vec3<T> g1 = inverse * (c * cross(e2, normal) - s * e2);
    const Vec3<T> g2 = inverse * (c * cross(normal, e1) - s * e1);
    (-g1).store(J);
    (g1 - g2).store(J + 3);
    g2.store(J + 6);
  }
};

}  // namespace sheetbend
