// along: C = (y1 - y0) . d - rest  [m], how far a point of the second body lies from a point of the first along a direction d of the first. Two of these with
// directions across a line keep the points on that line of the first body: with three `across` a slider, with two a cylindrical joint. Along the line itself,
// with a compliance [m/N], it is a spring or a damper of the slider.
// Stencil: (p, q, a1, a2, a3, b1, b2, b3). Never degenerate.
#pragma once

#include "core/constraints/carried.h"

namespace sheetbend {

struct Progress {
  static constexpr int vectors = 3, rows = 1, parameters = 1;
  static constexpr bool linear = false;
  static constexpr Unit unit = units::meters;
  static constexpr std::array own{Parameter{"rest", unit, ranges::any, defaults::usually(0.0)}};
  template <class T>
  static void evaluate(const T* y, const T* p, T* C, T* J) {
    const Vec3<T> way = Vec3<T>(y + 3) - Vec3<T>(y), direction(y + 6);
    C[0] = dot(way, direction) - p[0];
    (-direction).store(J);
    direction.store(J + 3);
    way.store(J + 6);
  }
};

// A law of the two points and the direction. Its parameters are their places in the bodies, then the law's `own`.
template <class Law>
struct AlongDirection : OnTwoBodies<Law, BodyPoint<0, 2>, BodyPoint<1, 5>, BodyDirection<2>> {
  static constexpr Unit unit = units::meters;
  static constexpr std::array parameters =
      joined(place_in_body("first_x", "first_y", "first_z"),     //
             place_in_body("second_x", "second_y", "second_z"),  //
             direction_in_body("direction_x", "direction_y", "direction_z"), Law::own);
};

struct Along : AlongDirection<Progress> {
  static constexpr const char* name = "along";
  static constexpr const char* about =
      "how far a point of the second body lies from one of the first along a direction of the first, less a rest "
      "length";
  static constexpr Compliance compliance{"displacement / force, 0 for a joint"};
  static constexpr int offsets = 1;
};

}  // namespace sheetbend
