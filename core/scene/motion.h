// Values given at knots in time: x(t) = sum_i weight_i knot_i with at most four knots, so that the adjoint is the same weights.
// cubic is C1: Hermite pieces whose slopes are the quadratic through three neighboring knots (exact for quadratics on inner pieces, also on uneven knots; one-sided slopes at the ends).
// Before the first and after the last knot the end value holds.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/scalar/vec3.h"

namespace sheetbend {

enum class Interpolation : int { linear, cubic };

struct KnotWeights {
  int first = 0;  // index of the first knot
  int count = 1;
  std::array<double, 4> weight{1.0, 0.0, 0.0, 0.0};
};

struct Knots {
  std::vector<double> times;
  Interpolation interpolation = Interpolation::cubic;
  KnotWeights at(double t) const;
};

// Value of something given at knots, (knots, slots, 3), for one slot.
template <class T>
Vec3<T> at_knots(const KnotWeights& k, const T* values, int slots, int slot) {
  Vec3<T> sum;
  for (int i = 0; i < k.count; ++i)
    sum = sum + k.weight[i] * Vec3<T>(values + 3 * ((static_cast<std::size_t>(k.first) + i) * slots + slot));
  return sum;
}

}  // namespace sheetbend
