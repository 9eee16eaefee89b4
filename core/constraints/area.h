// area: C = |(x1 - x0) x (x2 - x0)|/2 - rest, a triangle's area  [m^2]. Compliance A/K [m^3/N] for an area modulus K [N/m].
// Degenerate: a triangle without area.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

struct Area : OnPoints<3> {
  static constexpr const char* name = "area";
  static constexpr const char* about = "the area of a triangle less a rest area";
  static constexpr Unit unit = units::square_meters;
  static constexpr Compliance compliance{"area / area modulus"};
  static constexpr bool hot = true;
  static constexpr int rows = 1;
  static constexpr std::array parameters{Parameter{"rest", units::square_meters, ranges::positive, defaults::measured}};
  static constexpr int offsets = 1;

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const Vec3<T> e1 = Vec3<T>(x + 3) - Vec3<T>(x), e2 = Vec3<T>(x + 6) - Vec3<T>(x);
    const Vec3<T> normal = cross(e1, e2);
    const T size = norm(normal), half(0.5);
    const Vec3<T> unit = (half / size) * normal;
    C[0] = half * size - p[0];
    const Vec3<T> by_1 = cross(e2, unit), by_2 = cross(unit, e1);
    (-by_1 - by_2).store(J);
    by_1.store(J + 3);
    by_2.store(J + 6);
  }
};

}  // namespace sheetbend
