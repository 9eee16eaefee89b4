// body_distance: C = |y1 - y0| - rest_length  [m], between a point of one body and a point of another: a thread, a rigid link with a ball at either end, or with a
// compliance [m/N] a spring. body_particle_distance: the same between a point of a body and a particle.
// Stencils: (p, q, a1, a2, a3, b1, b2, b3), and (p, particle, a1, a2, a3). Degenerate: points that coincide, as in distance.
#pragma once

#include "core/constraints/carried.h"
#include "core/constraints/distance.h"

namespace sheetbend {

struct Span {
  static constexpr int vectors = 2, rows = 1, parameters = 1;
  static constexpr bool linear = false;
  template <class T>
  static void evaluate(const T* y, const T* p, T* C, T* J) {
    Distance::evaluate(y, p, C, J);
  }
};

inline constexpr Parameter given_length{"rest_length", units::meters, ranges::positive, defaults::given};

struct BodyDistance : OnTwoBodies<Span, BodyPoint<0, 2>, BodyPoint<1, 5>> {
  static constexpr const char* name = "body_distance";
  static constexpr const char* about = "the distance of points of two bodies less a rest length";
  static constexpr Unit unit = units::meters;
  static constexpr Compliance compliance{"displacement / force"};
  static constexpr int offsets = 1;
  static constexpr std::array parameters =
      joined(place_in_body("first_x", "first_y", "first_z"),  //
             place_in_body("second_x", "second_y", "second_z"), std::array{given_length});
};

struct BodyParticleDistance : CarriedOn<Span, 2, 1, 0, BodyPoint<0, 2>, NodeItself<1>> {
  static constexpr const char* name = "body_particle_distance";
  static constexpr const char* about = "the distance of a point of a body and a particle less a rest length";
  static constexpr Unit unit = units::meters;
  static constexpr Compliance compliance{"displacement / force"};
  static constexpr int offsets = 1;
  static constexpr std::array parameters = joined(place_in_body("x", "y", "z"), std::array{given_length});
};

}  // namespace sheetbend
