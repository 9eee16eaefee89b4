// tether: C = length - |x1 - x0| >= 0  [m], a long-range attachment that limits how far x1 gets from its anchor x0 (Kim, Chentanez & Mueller-Fischer
// 2012). Unilateral: slack, it does nothing. Compliance in m/N, usually 0. It makes sweeps converge on cloth that hardly stretches, and hides the
// cloth's own compliance where it is taut. Blocks of one only.
// Degenerate: coincident particles have no direction; they are slack.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

struct Tether : OnPoints<2> {
  static constexpr const char* name = "tether";
  static constexpr const char* about = "a length less the distance of two particles, never negative";
  static constexpr Unit unit = units::meters;
  static constexpr Compliance compliance{"displacement / force, usually 0"};
  static constexpr bool hot = true;
  static constexpr int rows = 1;
  static constexpr std::array parameters{Parameter{"length", units::meters, ranges::positive, defaults::measured}};
  static constexpr bool unilateral = true;
  static constexpr bool unit_gradients = true;

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const Vec3<T> e = Vec3<T>(x + 3) - Vec3<T>(x);
    const T length2 = dot(e, e), zero(0.0);
    const auto apart = length2 > zero;
    const T length = sqrt(select(apart, length2, T(1.0)));
    C[0] = p[0] - select(apart, length, zero);
    const Vec3<T> n = select(apart, T(1.0) / length, zero) * e;
    n.store(J);
    (-n).store(J + 3);
  }

  // Taut at the first positions: C falls with the distance, so that -C(0) is measured.
  static void measure(const double* x, double* p) {
    const double none = 0.0;
    double C, J[dofs];
    evaluate(x, &none, &C, J);
    p[0] = -C;
  }
};

}  // namespace sheetbend
