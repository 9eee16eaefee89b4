// yielding_curvature: material_curvature with internal friction, C = (kappa1 - rest1, ratio kappa2 - rest2) - share (set1, set2)  [-].
// A joint of two springs in parallel, one of which slides: of the stiffness EI1 the part `share` belongs to a spring that begins at the
// set (the last of the stencil, whose third number is unused) and slides along when its own curvature e = kappa - rest - set grows
// longer than `yield` (integrated curvature, as rest): kinematic hardening (Prager 1956), a Jenkin element beside a spring. Their sum has
// the gradient of one spring of stiffness EI1 about rest + share set, which is what C says; yield.h moves the set.
#pragma once

#include "core/constraints/material_curvature.h"

namespace sheetbend {

// Kinds with a set: their last node moves at the end of a substep as yield.h says.
template <class K>
inline constexpr bool Yields = requires { K::yield_parameter; };

struct YieldingCurvature : OnPoints<6> {
  static constexpr const char* name = "yielding_curvature";
  static constexpr int points = 3;
  static constexpr int rows = 2;
  static constexpr std::array<const char*, 5> parameters{"ratio", "share", "yield", "rest_1", "rest_2"};
  static constexpr int offsets = 2;
  static constexpr int share_parameter = 1, yield_parameter = 2;

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const T inner[] = {p[0], p[3], p[4]};
    T inner_J[rows * MaterialCurvature::dofs];
    MaterialCurvature::evaluate(x, inner, C, inner_J);
    for (int j = 0; j < rows; ++j) {
      C[j] = C[j] - p[share_parameter] * x[15 + j];
      for (int d = 0; d < 15; ++d) J[j * dofs + d] = inner_J[j * MaterialCurvature::dofs + d];
      for (int d = 0; d < 3; ++d) J[j * dofs + 15 + d] = d == j ? -p[share_parameter] : T(0.0);
    }
  }
};

}  // namespace sheetbend
