// tet_volume: C = (x1 - x0) . ((x2 - x0) x (x3 - x0))/6 - rest, a tetrahedron's signed volume  [m^3]. Compliance V/K [m^5/N] for a bulk modulus K [Pa].
// Nothing is degenerate. A kind for a test: tests/meta/test_new_kind.py adds it to a copy of the sources.
#pragma once

#include "core/constraints/concept.h"

namespace sheetbend {

struct TetVolume : OnPoints<4> {
  static constexpr const char* name = "tet_volume";
  static constexpr const char* about = "the signed volume of a tetrahedron less a rest volume";
  static constexpr Unit unit = units::cubic_meters;
  static constexpr Compliance compliance{"volume / bulk modulus"};
  static constexpr int rows = 1;
  static constexpr std::array parameters{Parameter{"rest", units::cubic_meters, ranges::any, defaults::measured}};
  static constexpr int offsets = 1;

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const auto edge = [x](int k) { return Vec3<T>(x + 3 * k) - Vec3<T>(x); };
    const Vec3<T> e1 = edge(1), e2 = edge(2), e3 = edge(3);
    const T sixth(1.0 / 6.0);
    const Vec3<T> by_1 = sixth * cross(e2, e3), by_2 = sixth * cross(e3, e1), by_3 = sixth * cross(e1, e2);
    C[0] = dot(e1, by_1) - p[0];
    (-(by_1 + by_2 + by_3)).store(J);
    by_1.store(J + 3);
    by_2.store(J + 6);
    by_3.store(J + 9);
  }
};

}  // namespace sheetbend
