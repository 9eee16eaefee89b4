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

template <class Law>
struct AboutHinge : CarriedOn<Law, 0, 2, 1, BodyDirection<0>, BodyDirection<0>, BodyDirection<3>, NodeItself<6>> {
  static constexpr std::array parameters =
      joined(direction_in_body("along_x", "along_y", "along_z"),     //
             direction_in_body("across_x", "across_y", "across_z"),  //
             direction_in_body("second_x", "second_y", "second_z"),
             std::array{Parameter{"yield", units::radians, ranges::positive, defaults::given}});
};

struct JointFriction : AboutHinge<DryTurn> {
  static constexpr const char* name = "joint_friction";
  static constexpr const char* about =
      "the angle of one body against another about a hinge, from the one it slid to, which is the x of the last "
      "particle (pinned)";
  static constexpr Unit unit = units::radians;
  static constexpr Compliance compliance = yield_over_torque;
  static constexpr int yield_parameter = 9;
  using Slider = AboutHinge<TurnFromSet>;
};

}  // namespace sheetbend
