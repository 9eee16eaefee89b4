// yielding_curvature: material_curvature with internal friction (yielding.h), C = (kappa1 - rest1, ratio kappa2 - rest2) - share (set1, set2)  [-].
// The third number of the set is unused. `yield` is an integrated curvature, as rest is: the yield curvature times the Voronoi length.
// section_yielding_curvature: the same between the normals of two sections.
#pragma once

#include "core/constraints/material_curvature.h"
#include "core/constraints/yielding.h"

namespace sheetbend {

struct YieldingCurvature : Yielding<MaterialCurvature> {
  static constexpr const char* name = "yielding_curvature";
  static constexpr const char* about = "material_curvature where a share of the stiffness yields";
  static constexpr bool hot_in_blocks = true;  // ropes between grips yield
};

struct SectionYieldingCurvature : Yielding<SectionCurvature> {
  static constexpr const char* name = "section_yielding_curvature";
  static constexpr const char* about = "section_curvature where a share of the stiffness yields";
};

}  // namespace sheetbend
