// yielding_brick_strain: brick_strain beside a volume row (solid_strain.h, with the usual values), that yields as von Mises (1913) says:
//
//   C = (E_11, E_22, E_33, sqrt2 E_23, sqrt2 E_13, sqrt2 E_12) - set/(1 + hardening)      alpha = 1/(2 mu V)
//
// The sliding spring (yielding.h) feels shape alone: its strain e is the deviator of C_elastic - set, and `yield` bounds |e|. With the yield stress
// s in tension and Prager's modulus of hardening H, hardening = H/(3 mu) and yield = s sqrt(2/3)/(2 mu): a bar that is pulled yields at s and goes on with the slope
// E H/(E + H); in shear the stress is s/sqrt(3) at yield. The plastic strain, of which nothing is volume, is set/(1 + hardening). Without hardening the
// material is perfectly plastic. Strains are small, rotations need not be.
#pragma once

#include "core/constraints/solid_strain.h"
#include "core/constraints/yielding.h"

namespace sheetbend {

struct UncoupledBrickStrain : SolidStrain<8, UncoupledRows> {
  static constexpr Unit unit = units::none;
  static constexpr Compliance compliance{"1 / (2 volume shear modulus), beside a volume row"};
  static constexpr std::array parameters = [] {
    std::array<Parameter, gradients> all{};
    name_gradients<8>(all);
    return all;
  }();
};

struct YieldingBrickStrain : Yielding<UncoupledBrickStrain, Hardening> {
  static constexpr const char* name = "yielding_brick_strain";
  static constexpr const char* about = "the strains at a point of a brick of eight nodes that yields in its shape";
  static constexpr bool yields_in_shape = true;
};

}  // namespace sheetbend
