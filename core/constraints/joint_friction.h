// joint_friction: dry friction (dry_friction.h) in a hinge between bodies. The angle from the set is theta of joint_angle.h less the set, the x of the
// stencil's last node [rad].
// Stencil and degenerate cases: as joint_angle.
#pragma once

#include "core/constraints/dry_friction.h"
#include "core/constraints/joint_angle.h"

namespace sheetbend {

// The angle from the set. The yield angle plays no part in it.
struct TurnFromSet {
  static constexpr int vectors = Turn::vectors, rows = 1, parameters = 1, inner_parameters = 1;
  static constexpr bool linear = false;
  static constexpr std::array own{Parameter{"yield", units::radians, ranges::positive, defaults::given}};
  template <class T>
  static void evaluate(const T* y, const T*, T* C, T* J) {
    const T rest(0.0);
    Turn::evaluate(y, &rest, C, J);
  }
};

struct DryTurn : TurnFromSet {
  template <class T>
  static void evaluate(const T* y, const T* p, T* C, T* J) {
    T e;
    TurnFromSet::evaluate(y, p, &e, J);
    slide_dry<3 * vectors>(e, p[0], C, J);
  }
};

struct JointFriction : AboutHinge<DryTurn, HingeDial> {
  static constexpr const char* name = "joint_friction";
  static constexpr const char* about =
      "the angle of one body against another about a hinge, from the one it slid to, which is the x of the last "
      "particle (pinned)";
  static constexpr Compliance compliance = yield_over_torque;
  static constexpr int yield_parameter = 9;
  using Slider = AboutHinge<TurnFromSet, HingeDial>;
};

}  // namespace sheetbend
