// The law of a pair that touches: a stiff push along the shortest way between the two, which never pulls and has the potential
//
//   kappa/2 max(0, D - d)^2          d: their distance (nearest.h),  D: the sum of their radii
//
// in multipliers, force times eta^2. Friction is that of law.h between the nearest points of both, as material points of their middle lines: slip is how
// much farther one went than the other in the substep, and the tangential force acts on both, against each other.
#pragma once

#include <algorithm>
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

// What friction reads besides, in the axes of the scene.
template <class T>
struct Rub {
  T friction{};
  Vec3<T> carried;  // tangential force on the first side before
  T from[12];       // history of the spots, as for Bdf: slip is counted from there
};

template <class T>
struct Meeting {
  T depth{};           // 0 where it does not push
  Vec3<T> tangential;  // on the first side
  bool rubs = false, slides = false;
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

// Whether the boxes around both sides, whose nodes are in the first `count` of these places (12 numbers each), are farther apart than `room`. Most pairs that
// are looked at are, and their nearest points are not asked for.
inline bool boxes_are_apart(bool triangle, const double (*places)[12], int count, double room) {
  const int second = triangle ? 3 : 6;
  for (int d = 0; d < 3; ++d) {
    double low[2] = {places[0][d], places[0][second + d]}, high[2] = {low[0], low[1]};
    for (int p = 0; p < count; ++p)
      for (int i = d; i < 12; i += 3) {
        const int side = i < second ? 0 : 1;
        low[side] = std::min(low[side], places[p][i]);
        high[side] = std::max(high[side], places[p][i]);
      }
    if (low[1] - high[0] > room || low[0] - high[1] > room) return true;
  }
  return false;
}

// Whether a pair touches with its nodes at x (12).
inline bool touches(bool triangle, const double* x, const PairNumbers<double>& n) {
  constexpr double rounding = 1.0 + 1e-12;
  double place[1][12];
  std::copy_n(x, 12, place[0]);
  return !boxes_are_apart(triangle, place, 1, rounding * n.touching) && distance_of(triangle, x, n) < n.touching;
}

// What acts on the nodes (12) of a pair that touches in this part; without friction where `rub` is null. Nothing where it does not push.
template <class T>
Meeting<T> meet(bool triangle, Part part, const T* x, const PairNumbers<T>& numbers, const Rub<T>* rub, T* force) {
  const Nearest<T> n = nearest_points(triangle, x, softness_of(numbers), part);
  Meeting<T> met;
  for (int d = 0; d < 12; ++d) force[d] = T(0.0);
  if (!(value_of(n.squared) > 0.0)) return met;
  const T distance = sqrt(n.squared), depth = numbers.touching - distance;
  if (!(value_of(depth) > 0.0)) return met;
  met.depth = depth;
  const T push = numbers.kappa * depth / distance;
  for (int k = 0; k < 4; ++k) ((push * n.weight[k]) * n.apart).store(force + 3 * k);
  if (!rub) return met;
  Vec3<T> slip;
  for (int k = 0; k < 4; ++k) slip = slip + n.weight[k] * (Vec3<T>(x + 3 * k) - Vec3<T>(rub->from + 3 * k));
  const T length = sqrt(dot(n.apart, n.apart));  // below the distance of segments, and the push with it
  const ContactForce<T> c = contact_force(-depth, (T(1.0) / length) * n.apart, slip, rub->carried,
                                          rub->friction * length / distance, numbers.kappa);
  met.tangential = c.tangential, met.rubs = c.rubs, met.slides = c.slides;
  for (int k = 0; k < 4; ++k) (n.weight[k] * c.tangential).add_to(force + 3 * k);
  return met;
}

// The same numbers over a larger scalar.
template <class U, class T>
Rub<U> constants(const Rub<T>& rub) {
  Rub<U> u{U(rub.friction), {U(rub.carried.x), U(rub.carried.y), U(rub.carried.z)}, {}};
  for (int d = 0; d < 12; ++d) u.from[d] = U(rub.from[d]);
  return u;
}

// E = -d force/dx (12, 12), row by row, where it pushes; otherwise E stays as it is. Returns whether friction acts.
inline bool meeting_matrix(bool triangle, Part part, const double* x, const PairNumbers<double>& numbers,
                           const Rub<double>* rub, double* E) {
  using D = Dual<double, 12>;
  D at[12], force[12];
  for (int d = 0; d < 12; ++d) {
    at[d] = D(x[d]);
    at[d].d[d] = 1.0;
  }
  Rub<D> rub_d;
  if (rub) rub_d = constants<D>(*rub);
  const Meeting<D> met =
      meet<D>(triangle, part, at, {D(numbers.touching), D(numbers.kappa)}, rub ? &rub_d : nullptr, force);
  if (!(value_of(met.depth) > 0.0)) return false;
  for (int a = 0; a < 12; ++a)
    for (int b = 0; b < 12; ++b) E[12 * a + b] = -force[a].d[b];
  return met.rubs;
}

}  // namespace sheetbend
