// across: C = d0 . d1  [-], the cosine between a direction of one body, d0 = e1 a1 + e2 a2 + e3 a3, and a direction of another, d1 likewise, where both have length
// one. Zero keeps them perpendicular: coincide with two of these is a hinge (the first body's axis against two directions across it of the second), with one
// a universal joint, with three a fixed one. With a compliance [1/(N m)] it gives way like a torsion spring.
// Stencil: the axes (a1, a2, a3, b1, b2, b3). Degenerate: parallel directions have no gradient of a turn about them.
#pragma once

#include "core/constraints/carried.h"

namespace sheetbend {

struct Cosine {
  static constexpr int vectors = 2, rows = 1, parameters = 0;
  static constexpr bool linear = false;
  template <class T>
  static void evaluate(const T* y, const T*, T* C, T* J) {
    const Vec3<T> first(y), second(y + 3);
    C[0] = dot(first, second);
    second.store(J);
    first.store(J + 3);
  }
};

struct DirectionsAcross : CarriedOn<Cosine, 0, 2, 0, BodyDirection<0>, BodyDirection<3>> {
  static constexpr const char* name = "across";
  static constexpr const char* about = "the cosine between directions of two bodies";
  static constexpr Unit unit = units::none;
  static constexpr Compliance compliance{"angle / torque, 0 for a joint"};
  static constexpr std::array parameters = joined(direction_in_body("first_x", "first_y", "first_z"),  //
                                                  direction_in_body("second_x", "second_y", "second_z"));
};

}  // namespace sheetbend
