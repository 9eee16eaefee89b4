// yielding_strain: strain with internal friction in shear (yielding.h), C = strain's, whose third row is shear (2 E_uv - share slid).
// The set holds shear slid in its third number, as the row is scaled; the first two stay zero, since the yarns themselves are elastic. `yield` bounds
// shear |2 E_uv - slid|: shear = sqrt(G/Y_u) times the shear strain at which yarns begin to slide on each other where they cross.
// In simple shear 2 E_uv is the tangent of the angle. A strip sheared back and forth beyond yield has a loop of the force per width over it that is
// 2 share G times that strain high, between two lines of the slope (1 - share) G: the hysteresis 2HG of Kawabata's shear test (1980).
#pragma once

#include "core/constraints/strain.h"
#include "core/constraints/yielding.h"

namespace sheetbend {

struct YieldingStrain : Yielding<Strain> {
  static constexpr const char* name = "yielding_strain";
  static constexpr const char* about = "strain where a share of the shear stiffness yields";
  static constexpr int first_sliding = 2;
};

}  // namespace sheetbend
