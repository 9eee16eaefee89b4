// angle_stop, slide_stop: how far a joint has gone beyond its range, zero within it. With z the joint's angle (joint_angle.h) or its shift along a direction
// (along.h), m the middle of its range, r half of the range, and t = |z - m| - r how far z lies beyond,
//
//   C = sign(z - m) q(t),   q = 0 for t <= 0,   t for a depth of 0,   otherwise with s = min(1, t/depth)   depth (s^2 - s^3/3) + max(0, t - depth).
//
// A compliance [rad/(N m), m/N] makes a linear stop, which pushes where t > 0 and does nothing elsewhere, as contacts do (core/contact/law.h): the energy
// q^2/(2 alpha) is convex, with a continuous slope. A damping coefficient c acts with c q'^2: over the depth it grows from zero, so that
// the torque does not jump where the stop is met or left, as that of a dashpot would (ADAMS' BISTOP ramps its damping likewise).
// The angle is periodic. Halfway around from the middle of its range it goes over from one limit to the other.
// Stencils: (a1, a2, a3, b1, b2, b3); (p, q, a1, a2, a3, b1, b2, b3). Degenerate: as joint_angle; C has a kink at t = 0 if the depth is 0. Within the
// range J is zero, so that the compliance must not be.
#pragma once

#include "core/constraints/along.h"
#include "core/constraints/joint_angle.h"

namespace sheetbend {

// q and its slope.
template <class T>
struct Ramp {
  T value, slope;
  Ramp(const T& t, const T& depth) {
    const T zero(0.0), one(1.0), third(1.0 / 3.0);
    const auto beyond = t > zero, gradual = depth > zero;
    const T d = select(gradual, depth, one), u = t / d;
    const auto partly = u < one;
    const T s = select(partly, u, one);
    const T grown = select(partly, d * s * s * (one - third * s), t - third * d);
    value = select(beyond, select(gradual, grown, t), zero);
    slope = select(beyond, select(gradual, s * (T(2.0) - s), one), zero);
  }
};

// Of a law of one row, with its dial, where it has one, at zero. Parameters: the middle of the range, half of it, the depth.
template <class Law, int Vectors>
struct BeyondRange {
  static constexpr int vectors = Vectors, rows = 1, parameters = 3, inner_parameters = 3;
  static constexpr bool linear = false;
  template <class T>
  static void evaluate(const T* y, const T* p, T* C, T* J) {
    constexpr int given = 3 * Vectors, all = 3 * Law::vectors;
    T own[all], from, along[all];
    const T zero(0.0);
    for (int d = 0; d < all; ++d) own[d] = d < given ? y[d] : zero;
    Law::evaluate(own, p, &from, along);
    const auto above = from > zero;
    const Ramp<T> ramp(select(above, from, -from) - p[1], p[2]);
    C[0] = select(above, ramp.value, -ramp.value);
    for (int d = 0; d < given; ++d) J[d] = ramp.slope * along[d];
  }
};

struct AngleStop : CarriedOn<BeyondRange<Turn, 3>, 0, 2, 0, BodyDirection<0>, BodyDirection<0>, BodyDirection<3>> {
  static constexpr const char* name = "angle_stop";
  static constexpr const char* about =
      "how far the angle of one body against another about a hinge lies beyond a range";
  static constexpr Unit unit = units::radians;
  static constexpr Compliance compliance{
      "angle / torque", Compliance::scalar,
      "within its range a stop has no gradient; give the angle by which it gives way per torque"};
  static constexpr std::array parameters =
      joined(direction_in_body("along_x", "along_y", "along_z"),     //
             direction_in_body("across_x", "across_y", "across_z"),  //
             direction_in_body("second_x", "second_y", "second_z"),
             std::array{Parameter{"middle", units::radians, ranges::any, defaults::given},
                        Parameter{"half_range", units::radians, Range{0.0}, defaults::given},
                        Parameter{"depth", units::radians, Range{0.0}, defaults::usually(0.0)}});
};

struct SlideStop : OnTwoBodies<BeyondRange<Progress, 3>, BodyPoint<0, 2>, BodyPoint<1, 5>, BodyDirection<2>> {
  static constexpr const char* name = "slide_stop";
  static constexpr const char* about =
      "how far a point of the second body lies, along a direction of the first, beyond a range from a point of the "
      "first";
  static constexpr Unit unit = units::meters;
  static constexpr Compliance compliance{
      "displacement / force", Compliance::scalar,
      "within its range a stop has no gradient; give the distance by which it gives way per force"};
  static constexpr std::array parameters =
      joined(place_in_body("first_x", "first_y", "first_z"),     //
             place_in_body("second_x", "second_y", "second_z"),  //
             direction_in_body("direction_x", "direction_y", "direction_z"),
             std::array{Parameter{"middle", units::meters, ranges::any, defaults::given},
                        Parameter{"half_range", units::meters, Range{0.0}, defaults::given},
                        Parameter{"depth", units::meters, Range{0.0}, defaults::usually(0.0)}});
};

}  // namespace sheetbend
