// yielding_curvature: material_curvature with internal friction, C = (kappa1 - rest1, ratio kappa2 - rest2) - share (set1, set2)  [-].
// A joint of two springs in parallel, one of which slides: of the stiffness EI1 the part `share` belongs to a spring that begins at the
// set (the last of the stencil, whose third number is unused) and slides along when its own curvature e = kappa - rest - set grows
// longer than `yield` (integrated curvature, as rest): kinematic hardening (Prager 1956), a Jenkin element beside a spring. Their sum has
// the gradient of one spring of stiffness EI1 about rest + share set, which is what C says; yield.h moves the set.
// section_yielding_curvature: the same between the normals of two sections.
#pragma once

#include "core/constraints/material_curvature.h"

namespace sheetbend {

template <class Elastic>
struct YieldingInFrames : OnPoints<Elastic::arity + 1> {
  static constexpr int points = Elastic::points;
  static constexpr Unit unit = units::none;
  static constexpr Compliance compliance{"Voronoi length / EI", Compliance::matrix};
  static constexpr int rows = 2, dofs = Elastic::dofs + 3;
  static constexpr std::array parameters{Parameter{"ratio", units::none, ranges::any, defaults::preset(1.0)},
                                         Parameter{"share", units::none, ranges::from_zero_below_one, defaults::given},
                                         Parameter{"yield", units::none, ranges::positive, defaults::given},
                                         Parameter{"rest_1", units::none, ranges::any, defaults::usually(0.0)},
                                         Parameter{"rest_2", units::none, ranges::any, defaults::usually(0.0)}};
  static constexpr int offsets = 2;
  static constexpr int share_parameter = 1, yield_parameter = 2;

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    constexpr int set = Elastic::dofs;
    const T inner[] = {p[0], p[3], p[4]};
    T inner_J[rows * set];
    Elastic::evaluate(x, inner, C, inner_J);
    for (int j = 0; j < rows; ++j) {
      C[j] = C[j] - p[share_parameter] * x[set + j];
      for (int d = 0; d < set; ++d) J[j * dofs + d] = inner_J[j * set + d];
      for (int d = 0; d < 3; ++d) J[j * dofs + set + d] = d == j ? -p[share_parameter] : T(0.0);
    }
  }
};

struct YieldingCurvature : YieldingInFrames<MaterialCurvature> {
  static constexpr const char* name = "yielding_curvature";
  static constexpr const char* about = "material_curvature where a share of the stiffness yields";
};

struct SectionYieldingCurvature : YieldingInFrames<SectionCurvature> {
  static constexpr const char* name = "section_yielding_curvature";
  static constexpr const char* about = "section_curvature where a share of the stiffness yields";
};

}  // namespace sheetbend
