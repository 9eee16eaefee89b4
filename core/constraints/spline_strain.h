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
  static constexpr std::array<const char*, 22> parameters{
      "N1_u",          "N1_v",          "N2_u",          "N2_v",         "coupling",  "weft",
      "shear",         "spacing_u",     "ratio_u_1",     "ratio_u_2",    "ratio_u_3", "ratio_u_4",
      "spacing_v",     "ratio_v_1",     "ratio_v_2",     "ratio_v_3",    "ratio_v_4", "spacing_shear",
      "ratio_shear_1", "ratio_shear_2", "ratio_shear_3", "ratio_shear_4"};
};

}  // namespace sheetbend
