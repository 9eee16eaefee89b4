// yielding_sheet_curvature: sheet_curvature with internal friction (yielding.h), C = (kappa_uu, weft kappa_vv, twist kappa_uv) - share set  [1/m].
// The rows are scaled as the energy is, so that `yield` is a curvature along the warp, |e|^2 = e_uu^2 + (B_weft e_vv^2 + 2 B_twist e_uv^2)/B_warp:
// where the three rigidities are equal, a sheet yields alike in all directions.
// A strip bent back and forth beyond yield has a loop of the moment per width over the curvature that is 2 share B yield high, between two lines of
// the slope (1 - share) B: the hysteresis 2HB of Kawabata's bending test (1980), from Coulomb's friction between fibers.
#pragma once

#include "core/constraints/sheet_curvature.h"
#include "core/constraints/yielding.h"

namespace sheetbend {

struct YieldingSheetCurvature : Yielding<SheetCurvature> {
  static constexpr const char* name = "yielding_sheet_curvature";
  static constexpr const char* about = "sheet_curvature where a share of the stiffness yields";
};

}  // namespace sheetbend
