// sinh_strain: a membrane (membrane.h) whose tension is a hyperbolic sine of each strain component: linear at rest, then exponential in the strain
// itself, where exponential_strain grows with its square. The energy k (cosh(b e) - 1)/b^2 has the stiffness k at rest, the stress k sinh(b e)/b and
// the tangent k cosh(b e). Its exact force comes from f = 2 sinh(b e/2)/b, which is smooth at rest and for b = 0.
//
// A projection leaves out f f'' against f'^2: sinh^2 against cosh^2 of b e/2, so its matrix holds at least half of the true stiffness.
// Infinite beyond b e = 1419.
#pragma once

#include "core/constraints/exponential_strain.h"
#include "core/constraints/membrane.h"
#include "core/scalar/exponential.h"

namespace sheetbend {

struct SinhLaw {
  static constexpr int coefficients = 1;
  template <class T>
  static Stretched<T> apply(const T& strain, const T* b) {
    const T half(0.5), one(1.0);
    const Exponential<T> e(half * b[0] * strain);
    const T inverse = one / e.value;
    return {half * strain * e.mean_slope * (one + inverse),
            half * (e.value + inverse)};  // sinh t = (exp t - 1)(1 + exp -t)/2
  }
};

struct SinhStrain : Membrane<SinhLaw> {
  static constexpr const char* name = "sinh_strain";
  static constexpr const char* about = "the strains of a triangle, its stiffness exponential in them";
  static constexpr Unit unit = units::none;
  static constexpr Compliance compliance{"1 / (area warp stiffness)", Compliance::matrix};
  static constexpr auto parameters = ExponentialStrain::parameters;
};

}  // namespace sheetbend
