// coincide: C = y0 - y1  [m], the way between a point of one body and a point of another, y0 = p + X1 a1 + X2 a2 + X3 a3 and y1 likewise: a ball joint, and with
// others (across.h, along.h) the part of joints that holds their places together. With a compliance [m/N] it is a mount.
// coincide_particle: the same for a point of a body and a particle: the end of a rope in a plug, a vertex of a cloth on a pole.
// Stencils: (p, q, a1, a2, a3, b1, b2, b3), and (p, particle, a1, a2, a3). Never degenerate.
#pragma once

#include "core/constraints/carried.h"

namespace sheetbend {

struct WayBetween {
  static constexpr int vectors = 2, rows = 3, parameters = 0;
  static constexpr bool linear = true;
  template <class T>
  static void evaluate(const T* y, const T*, T* C, T* J) {
    for (int i = 0; i < 3; ++i) {
      C[i] = y[i] - y[3 + i];
      for (int k = 0; k < 6; ++k) J[6 * i + k] = T(k == i ? 1.0 : k == 3 + i ? -1.0 : 0.0);
    }
  }
};

struct Coincide : OnTwoBodies<WayBetween, BodyPoint<0, 2>, BodyPoint<1, 5>> {
  static constexpr const char* name = "coincide";
  static constexpr const char* about = "the way from a point of the second body to a point of the first";
  static constexpr Unit unit = units::meters;
  static constexpr Compliance compliance{"displacement / force, 0 for a joint"};
  static constexpr std::array parameters = joined(place_in_body("first_x", "first_y", "first_z"),  //
                                                  place_in_body("second_x", "second_y", "second_z"));
};

struct CoincideParticle : CarriedOn<WayBetween, 2, 1, 0, BodyPoint<0, 2>, NodeItself<1>> {
  static constexpr const char* name = "coincide_particle";
  static constexpr const char* about = "the way from a particle to a point of a body";
  static constexpr Unit unit = units::meters;
  static constexpr Compliance compliance{"displacement / force, 0 for a joint"};
  static constexpr std::array parameters = place_in_body("x", "y", "z");
};

}  // namespace sheetbend
