// spline_strain: a membrane (membrane.h) whose stiffness against each strain component is a curve of its own: the tangent stiffness over that at
// rest is 1 at strain 0 and r1 ... r4 at 1 ... 4 times a spacing, straight between, constant beyond, and 1 in compression. Where all are positive
// the tension rises monotonically. Tension and energy are its integrals, so that f = e sqrt(g) has f f' = tension/k without a quotient of zeros.
// What exponential_strain.h says of projections holds here too.
#pragma once

#include "core/constraints/membrane.h"

namespace sheetbend {

struct SplineLaw {
  static constexpr int knots = 4;
  static constexpr int coefficients = 1 + knots;

  // coefficients: spacing, r1 ... r4. With s = e/spacing the tangent is 1 + sum_i c_i max(s - i, 0), c_i its changes of slope.
  template <class T>
  static Stretched<T> apply(const T& strain, const T* coefficients) {
    const T one(1.0), zero(0.0), *ratio = coefficients + 1;
    const T s = strain / coefficients[0];
    const T inverse = one / select(s > one, s, one);  // terms beyond the first knot vanish below it
    T slope = ratio[0] - one;
    const T first = slope * select(s > zero, s, zero);
    T g = first * T(1.0 / 3.0), tension = first * T(0.5);
    for (int i = 1; i <= knots; ++i) {
      const T next = i < knots ? ratio[i] - ratio[i - 1] : zero, change = next - slope;
      const T past = s - T(double(i)), beyond = select(past > zero, past, zero), share = beyond * inverse;
      g += change * beyond * share * share * T(1.0 / 3.0);
      tension += change * beyond * share * T(0.5);
      slope = next;
    }
    const T root = sqrt(one + g);
    return {strain * root, (one + tension) / root};
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
