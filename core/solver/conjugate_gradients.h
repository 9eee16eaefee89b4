// Preconditioned conjugate gradients (Hestenes & Stiefel 1952; Saad, Iterative Methods for Sparse Linear Systems, 2nd ed., algorithm 9.1) over
// particles' coordinates, for one right side or one per lane. A lane that has converged stands still: it ends with the bits that it has alone.
#pragma once

#include <algorithm>
#include <stdexcept>

#include "core/scalar/pack.h"
#include "core/scalar/vec3.h"

namespace sheetbend {

// A residual r of H z = b is as large as the root of r^T M^-1 r, M being the preconditioner.
struct Stopping {
  double tolerance;  // of the residual over the right side
  int most;          // iterations
};

// Conjugate gradients took as many iterations as they may.
struct Unconverged : std::runtime_error {
  int iterations;
  double residual;  // over the right side
  Unconverged(const Stopping& stop, double residual_);
};

inline double lane_of(double a, int) { return a; }
template <int N>
double lane_of(const Lanes<N>& a, int lane) {
  return a[lane];
}

// The largest a/b of the lanes where a > b; zero where there is none. What is not a number counts as converged, for the rollout to find.
template <class U>
double largest_excess(const U& a, const U& b) {
  double largest = 0.0;
  for (int lane = 0; lane < static_cast<int>(sizeof(U) / sizeof(double)); ++lane)
    if (lane_of(a, lane) > lane_of(b, lane)) largest = std::max(largest, lane_of(a, lane) / lane_of(b, lane));
  return largest;
}

// A dot product, particle by particle.
template <class U>
struct DotProduct {
  Vec3<U> sum{U(0.0), U(0.0), U(0.0)};
  void add(const U* a, const U* b) { sum = sum + Vec3<U>(a[0] * b[0], a[1] * b[1], a[2] * b[2]); }
  U total() const { return (sum.x + sum.y) + sum.z; }
};

// b = H^-1 b. H.multiply(p, q) is q = H p, H.precondition(i, z) is z = M^-1 z for the three numbers of particle i. `work` has three times as many
// numbers as b. Gives the number of iterations.
template <class U, class Matrix>
int conjugate_gradients(const Matrix& H, int particles, const Stopping& stop, U* b, U* work) {
  const std::size_t size = 3 * static_cast<std::size_t>(particles);
  const U zero(0.0), one(1.0);
  U *z = work, *p = z + size, *q = p + size, *r = b;
  DotProduct<U> start;
  for (int i = 0; i < particles; ++i) {
    const std::size_t at = 3 * static_cast<std::size_t>(i);
    for (std::size_t d = at; d < at + 3; ++d) {
      z[d] = zero;
      p[d] = r[d];
    }
    H.precondition(i, p + at);
    start.add(r + at, p + at);
  }
  U left = start.total();
  const U enough = U(stop.tolerance * stop.tolerance) * left;
  int iteration = 0;
  for (double excess; (excess = largest_excess(left, enough)) > 0.0; ++iteration) {
    if (iteration == stop.most) throw Unconverged(stop, stop.tolerance * sqrt(excess));
    H.multiply(p, q);
    DotProduct<U> curvature, next;
    for (std::size_t at = 0; at < size; at += 3) curvature.add(p + at, q + at);
    const auto moves = left > enough;
    const U step = select(moves, left / select(moves, curvature.total(), one), zero);
    for (int i = 0; i < particles; ++i) {
      const std::size_t at = 3 * static_cast<std::size_t>(i);
      for (std::size_t d = at; d < at + 3; ++d) {
        z[d] += step * p[d];
        r[d] -= step * q[d];
        q[d] = r[d];
      }
      H.precondition(i, q + at);
      next.add(r + at, q + at);
    }
    const U turn = select(moves, next.total() / select(moves, left, one), zero);
    for (std::size_t d = 0; d < size; ++d) p[d] = q[d] + turn * p[d];
    left = select(moves, next.total(), left);
  }
  std::copy_n(z, size, b);
  return iteration;
}

}  // namespace sheetbend
