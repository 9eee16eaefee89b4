// strain: an orthotropic St. Venant-Kirchhoff membrane; see membrane.h.
#pragma once

#include "core/constraints/membrane.h"

namespace sheetbend {

struct LinearLaw {
  static constexpr int coefficients = 0;
  template <class T>
  static Stretched<T> apply(const T& strain, const T*) {
    return {strain, T(1.0)};
  }
};

struct Strain : Membrane<LinearLaw> {
  static constexpr const char* name = "strain";
  static constexpr const char* about = "the strains of a triangle, orthotropic and linear";
  static constexpr Unit unit = units::none;
  static constexpr Compliance compliance{"1 / (area warp stiffness)", Compliance::matrix};
  static constexpr bool hot = true;
  static constexpr std::array parameters{
      Parameter{"N1_u", units::per_meter, ranges::any, defaults::given},
      Parameter{"N1_v", units::per_meter, ranges::any, defaults::given},
      Parameter{"N2_u", units::per_meter, ranges::any, defaults::given},
      Parameter{"N2_v", units::per_meter, ranges::any, defaults::given},
      Parameter{"coupling", units::none, ranges::between_minus_one_and_one, defaults::given},
      Parameter{"weft", units::none, ranges::any, defaults::given},
      Parameter{"shear", units::none, ranges::any, defaults::given}};
};

}  // namespace sheetbend
