// BeyondRange<Law>: how far a law of one row has gone beyond a range, zero within it. With z the law's value, m the middle of the range, r half of the range,
// and t = |z - m| - r how far z lies beyond,
//
//   C = sign(z - m) q(t),   q = 0 for t <= 0,   t for a depth of 0,   otherwise with s = min(1, t/depth)   depth (s^2 - s^3/3) + max(0, t - depth).
//
// A compliance makes a linear stop, which pushes where t > 0 and does nothing elsewhere, as contacts do (core/contact/law.h): the energy
// q^2/(2 alpha) is convex, with a continuous slope. A damping coefficient c acts with c q'^2: over the depth it grows from zero, so that
// the torque does not jump where the stop is met or left, as that of a dashpot would (ADAMS' BISTOP ramps its damping likewise).
// Degenerate: C has a kink at t = 0 if the depth is 0. Within the range J is zero, so that the compliance must not be.
#pragma once

#include <array>

#include "core/constraints/parameter.h"
#include "core/scalar/scalar.h"

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
  static constexpr std::array own{Parameter{"middle", Law::unit, ranges::any, defaults::given},
                                  Parameter{"half_range", Law::unit, Range{0.0}, defaults::given},
                                  Parameter{"depth", Law::unit, Range{0.0}, defaults::usually(0.0)}};
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

}  // namespace sheetbend
