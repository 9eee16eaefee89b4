// exponential_strain: a membrane (membrane.h) that stiffens as woven and knitted cloth does, with Fung's law per component (Fung 1967):
// the energy k (exp(b e^2) - 1)/(2 b) of a strain e has the stiffness k at rest and grows by the factor exp(b e^2) (1 + 2 b e^2).
// Its exact force comes from f = e sqrt((exp(b e^2) - 1)/(b e^2)), which is smooth at rest.
//
// A projection leaves out f f'' against f'^2, as XPBD does with all curvature of C. With t = b e^2 its matrix holds (t exp(t)/(exp(t) - 1))/(1 + 2 t)
// of the true stiffness, from 1 at rest to 1/2; docs/decisions says how far sweeps converge. Newton's method for equilibria takes all of it.
// Infinite beyond b e^2 = 709.
#pragma once

#include "core/constraints/membrane.h"
#include "core/scalar/exponential.h"

namespace sheetbend {

struct ExponentialLaw {
  static constexpr int coefficients = 1;
  template <class T>
  static Stretched<T> apply(const T& strain, const T* b) {
    const Exponential<T> e(b[0] * strain * strain);
    const T root = sqrt(e.mean_slope);
    return {strain * root, e.value / root};
  }
};

struct ExponentialStrain : Membrane<ExponentialLaw> {
  static constexpr const char* name = "exponential_strain";
  static constexpr const char* about = "the strains of a triangle, its stiffness exponential in their squares";
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
      Parameter{"stiffening_u", units::none, ranges::any, defaults::given},
      Parameter{"stiffening_v", units::none, ranges::any, defaults::given},
      Parameter{"stiffening_shear", units::none, ranges::any, defaults::given}};
};

}  // namespace sheetbend
