// distance: C = |x1 - x0| - rest_length  [m].
// Compliance alpha = l / EA [m/N] makes a link of length l of a rope with axial stiffness EA [N] (Macklin et al. 2016, eq. 18).
// Degenerate: coincident particles have no direction; their gradient is zero, so nothing pushes them apart.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

struct Distance : OnPoints<2> {
  static constexpr const char* name = "distance";
  static constexpr int rows = 1;
  static constexpr std::array<const char*, 1> parameters{"rest_length"};

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const Vec3<T> e = Vec3<T>(x + 3) - Vec3<T>(x);
    const T length2 = dot(e, e);
    const auto apart = length2 > T(0.0);
    const T length = sqrt(select(apart, length2, T(1.0)));
    const Vec3<T> n = select(apart, T(1.0) / length, T(0.0)) * e;
    C[0] = select(apart, length, T(0.0)) - p[0];
    (-n).store(J);
    n.store(J + 3);
  }
};

}  // namespace sheetbend
