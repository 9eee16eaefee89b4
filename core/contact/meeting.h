// The law of a pair that touches: a stiff push along the shortest way between the two, which never pulls and has the potential
//
//   kappa/2 max(0, D - d)^2          d: their distance (nearest.h),  D: the sum of their radii
//
// in multipliers, force times eta^2. There is no friction.
#pragma once

#include <cmath>

#include "core/contact/law.h"
#include "core/contact/nearest.h"
#include "core/scalar/dual.h"

namespace sheetbend {

template <class T>
struct PairNumbers {
  T touching{};  // D
  T kappa{};
};

// D and kappa = stiffness/w of a pair, w the inverse mass of the middles of its sides. stiffness: rigidity (eta/h)^2.
template <class T>
PairNumbers<T> pair_numbers(bool triangle, const T& first_radius, const T& second_radius, const T* w,
                            double stiffness) {
  const T sum = triangle ? w[0] + T(1.0 / 9.0) * (w[1] + w[2] + w[3]) : T(0.25) * (w[0] + w[1] + w[2] + w[3]);
  return {first_radius + second_radius, T(stiffness) / sum};
}

template <class T>
T softness_of(const PairNumbers<T>& numbers) {
  return T(segment_softness) * numbers.touching * numbers.touching;
}

// How far two are apart, at these coordinates of their four nodes (12).
inline double distance_of(bool triangle, const double* x, const PairNumbers<double>& n) {
  const double softness = softness_of(n);
  return std::sqrt(nearest_points(triangle, x, softness, nearest_part(triangle, x, softness)).squared);
}

// What acts on the nodes (12) of a pair that touches in this part; returns how deep. Without force where it does not push.
template <class T>
T meet(bool triangle, Part part, const T* x, const PairNumbers<T>& numbers, T* force) {
  const Nearest<T> n = nearest_points(triangle, x, softness_of(numbers), part);
  for (int d = 0; d < 12; ++d) force[d] = T(0.0);
  if (!(value_of(n.squared) > 0.0)) return T(0.0);
  const T distance = sqrt(n.squared), depth = numbers.touching - distance;
  if (!(value_of(depth) > 0.0)) return T(0.0);
  const T push = numbers.kappa * depth / distance;
  for (int k = 0; k < 4; ++k) ((push * n.weight[k]) * n.apart).store(force + 3 * k);
  return depth;
}

// E = -d force/dx (12, 12), row by row.
inline void meeting_matrix(bool triangle, Part part, const double* x, const PairNumbers<double>& numbers, double* E) {
  using D = Dual<double, 12>;
  D at[12], force[12];
  for (int d = 0; d < 12; ++d) {
    at[d] = D(x[d]);
    at[d].d[d] = 1.0;
  }
  meet<D>(triangle, part, at, {D(numbers.touching), D(numbers.kappa)}, force);
  for (int a = 0; a < 12; ++a)
    for (int b = 0; b < 12; ++b) E[12 * a + b] = -force[a].d[b];
}

}  // namespace sheetbend
