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
  static constexpr std::array<const char*, 7> parameters{"N1_u", "N1_v", "N2_u", "N2_v", "coupling", "weft", "shear"};
};

}  // namespace sheetbend
