// spline_strain: a membrane (membrane.h) whose stiffness against each strain component is a curve of its own: the tangent stiffness over that at
// rest is 1 at strain 0 and r1 ... r4 at 1 ... 4 times a spacing, straight between, constant beyond, and 1 in compression. Where all are positive
// the tension rises monotonically. Tension and energy are its integrals, so that f = e sqrt(2 energy/(k e^2)) has f f' = tension/k.
// What exponential_strain.h says of projections holds here too.
#pragma once

#include "core/constraints/membrane.h"

namespace sheetbend {

struct SplineLaw {
  static constexpr int knots = 4;
  static constexpr int coefficients = 1 + knots;

  // coefficients: spacing, r1 ... r4. In s = e/spacing the integrals grow interval by interval, all terms of one sign; up to the first knot they
  // are divided by s and s^2 as polynomials.
  template <class T>
  static Stretched<T> apply(const T& strain, const T* coefficients) {
    const T one(1.0), zero(0.0), half(0.5), third(1.0 / 3.0), *ratio = coefficients + 1;
    const T s = strain / coefficients[0];
    const T rise = ratio[0] - one, pulled = select(s > zero, s, zero);
    T tension = one + half * rise, twice_energy = one + third * rise;  // at the first knot
    for (int i = 0; i < knots; ++i) {
      const T past = s - T(i + 1.0), some = select(past > zero, past, zero);
      const bool last = i + 1 == knots;
      const T u = last ? some : select(some > one, one, some), change = last ? zero : ratio[i + 1] - ratio[i];
      twice_energy += u * (T(2.0) * tension + u * (ratio[i] + third * u * change));
      tension += u * (ratio[i] + half * u * change);
    }
    const auto beyond = s > one;
    const T inverse = one / select(beyond, s, one);
    const T root = sqrt(select(beyond, twice_energy * inverse * inverse, one + third * rise * pulled));
    return {strain * root, select(beyond, tension * inverse, one + half * rise * pulled) / root};
  }
};

struct SplineStrain : Membrane<SplineLaw> {
  static constexpr const char* name = "spline_strain";
  static constexpr const char* about = "the strains of a triangle, its stiffness a curve of each";
  static constexpr Unit unit = units::none;
  static constexpr Compliance compliance{"1 / (area warp stiffness)", Compliance::matrix};
  static constexpr std::array parameters{
      Parameter{"N1_u", units::per_meter, ranges::any, defaults::given},
      Parameter{"N1_v", units::per_meter, ranges::any, defaults::given},
      Parameter{"N2_u", units::per_meter, ranges::any, defaults::given},
      Parameter{"N2_v", units::per_meter, ranges::any, defaults::given},
      Parameter{"coupling", units::none, ranges::between_minus_one_and_one, defaults::given},
      Parameter{"weft", units::none, ranges::any, defaults::given},
      Parameter{"shear", units::none, ranges::any, defaults::given},
      Parameter{"spacing_u", units::none, ranges::any, defaults::given},
      Parameter{"ratio_u_1", units::none, ranges::any, defaults::given},
      Parameter{"ratio_u_2", units::none, ranges::any, defaults::given},
      Parameter{"ratio_u_3", units::none, ranges::any, defaults::given},
      Parameter{"ratio_u_4", units::none, ranges::any, defaults::given},
      Parameter{"spacing_v", units::none, ranges::any, defaults::given},
      Parameter{"ratio_v_1", units::none, ranges::any, defaults::given},
      Parameter{"ratio_v_2", units::none, ranges::any, defaults::given},
      Parameter{"ratio_v_3", units::none, ranges::any, defaults::given},
      Parameter{"ratio_v_4", units::none, ranges::any, defaults::given},
      Parameter{"spacing_shear", units::none, ranges::any, defaults::given},
      Parameter{"ratio_shear_1", units::none, ranges::any, defaults::given},
      Parameter{"ratio_shear_2", units::none, ranges::any, defaults::given},
      Parameter{"ratio_shear_3", units::none, ranges::any, defaults::given},
      Parameter{"ratio_shear_4", units::none, ranges::any, defaults::given}};
};

}  // namespace sheetbend
