// Preconditioned conjugate gradients (Hestenes & Stiefel 1952; Saad, Iterative Methods for Sparse Linear Systems, 2nd ed., algorithm 9.1) over
// particles' coordinates, for one right side or one per lane. A lane that has converged stands still: it ends with the bits that it has alone.
#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>

#include "core/scalar/pack.h"
#include "core/scalar/vec3.h"

namespace sheetbend {

// A residual r of H z = b is as large as the root of r^T M^-1 r, M being the preconditioner.
struct Stopping {
  double tolerance;  // of the residual over the right side
  int most;          // iterations
};

// An iteration took as many steps as it may: conjugate gradients, or (derived) Newton's method.
struct Unconverged : std::runtime_error {
  int iterations;
  double residual;  // over the right side
  Unconverged(const Stopping& stop, double residual_);

 protected:
  Unconverged(const std::string& words, int iterations_, double residual_)
      : std::runtime_error(words), iterations(iterations_), residual(residual_) {}
};

inline double lane_of(double a, int) { return a; }
template <int N>
double lane_of(const Lanes<N>& a, int lane) {
  return a[lane];
}

// The largest a/b of the lanes where a > b; zero where there is none. What is not a number counts as converged, for the rollout to find.
template <class U>
double largest_excess(const U& a, const U& b) {
  constexpr int lanes = sizeof(U) / sizeof(double);  // NOLINT(bugprone-sizeof-expression): one of a double
  double largest = 0.0;
  for (int lane = 0; lane < lanes; ++lane)
    if (lane_of(a, lane) > lane_of(b, lane)) largest = std::max(largest, lane_of(a, lane) / lane_of(b, lane));
  return largest;
}

// Particle by particle.
template <class U>
U dot_product(const U* a, const U* b, std::size_t size) {
  Vec3<U> sum{U(0.0), U(0.0), U(0.0)};
  for (std::size_t d = 0; d < size; d += 3) sum = sum + Vec3<U>(a[d] * b[d], a[d + 1] * b[d + 1], a[d + 2] * b[d + 2]);
  return (sum.x + sum.y) + sum.z;
}

// b = H^-1 b. H.multiply(p, q) is q = H p, H.precondition(r, z) is z = M^-1 r. `work` has three times as many numbers as b. Gives the number of
// iterations.
template <class U, class Matrix>
int conjugate_gradients(const Matrix& H, int particles, const Stopping& stop, U* b, U* work) {
  const std::size_t size = 3 * static_cast<std::size_t>(particles);
  const U zero(0.0), one(1.0);
  U *z = work, *p = z + size, *q = p + size, *r = b;
  std::fill_n(z, size, zero);
  H.precondition(r, p);
  U left = dot_product(r, p, size);
  const U enough = U(stop.tolerance * stop.tolerance) * left;
  int iteration = 0;
  for (double excess; (excess = largest_excess(left, enough)) > 0.0; ++iteration) {
    if (iteration == stop.most) throw Unconverged(stop, stop.tolerance * sqrt(excess));
    H.multiply(p, q);
    const auto moves = left > enough;
    const U curvature = dot_product(p, q, size), step = select(moves, left / select(moves, curvature, one), zero);
    for (std::size_t d = 0; d < size; ++d) {
      z[d] += step * p[d];
      r[d] -= step * q[d];
    }
    H.precondition(r, q);
    const U next = dot_product(r, q, size), turn = select(moves, next / select(moves, left, one), zero);
    for (std::size_t d = 0; d < size; ++d) p[d] = q[d] + turn * p[d];
    left = select(moves, next, left);
  }
  std::copy_n(z, size, b);
  return iteration;
}

}  // namespace sheetbend
