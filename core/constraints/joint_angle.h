// joint_angle: C = theta - rest - dial  [rad], the angle by which the second body is turned against the first about a hinge,
//
//   theta = atan2(f . u, e . u),
//
// e and f directions of the first body across the hinge's axis n, f = n x e, and u the direction of the second that points along e at theta = 0. Compliance in
// rad/(N m): a torsion spring; with damping alone a viscous hinge of torque -c d(theta)/dt; with compliance 0 a servo. The dial is the x of the stencil's last
// node: pinned at zero, or driven, so that its motion is the servo's and its gradient the boundary's. The angle is periodic.
// Stencil: the axes (a1, a2, a3, b1, b2, b3), the dial. Degenerate: u along the hinge's axis.
#pragma once

#include "core/constraints/carried.h"

namespace sheetbend {

struct Turn {
  static constexpr int vectors = 4, rows = 1, parameters = 1;
  static constexpr bool linear = false, periodic = true;
  static constexpr Unit unit = units::radians;
  static constexpr std::array own{Parameter{"rest", unit, ranges::any, defaults::usually(0.0)}};
  template <class T>
  static void evaluate(const T* y, const T* p, T* C, T* J) {
    const Vec3<T> e(y), f(y + 3), u(y + 6);
    const T s = dot(f, u), c = dot(e, u), inverse = T(1.0) / (s * s + c * c);
    C[0] = difference<Turn>(atan2(s, c), p[0] + y[9]);
    const T by_s = inverse * c, by_c = -(inverse * s);
    (by_c * u).store(J);
    (by_s * u).store(J + 3);
    (by_s * f + by_c * e).store(J + 6);
    Vec3<T>(T(-1.0), T(0.0), T(0.0)).store(J + 9);
  }
};

// A law of e, f and u, and of the dial where it takes a fourth vector. Its parameters are those of the directions, then the law's `own`.
template <class Law, class... Dial>
struct AboutHinge
    : CarriedOn<Law, 0, 2, sizeof...(Dial), BodyDirection<0>, BodyDirection<0>, BodyDirection<3>, Dial...> {
  static constexpr Unit unit = units::radians;
  static constexpr std::array parameters = joined(direction_in_body("along_x", "along_y", "along_z"),     //
                                                  direction_in_body("across_x", "across_y", "across_z"),  //
                                                  direction_in_body("second_x", "second_y", "second_z"), Law::own);
};
using HingeDial = NodeItself<6>;

struct JointAngle : AboutHinge<Turn, HingeDial> {
  static constexpr const char* name = "joint_angle";
  static constexpr const char* about =
      "the angle of one body against another about a hinge, less a rest angle and the x of the last particle";
  static constexpr Compliance compliance{"angle / torque, 0 for a servo"};
  static constexpr bool periodic = true;
  static constexpr int offsets = 1;
};

}  // namespace sheetbend
