// friction_hinge: dry friction (dry_friction.h) about a fixed unit normal. The angle from the set is theta of hinge.h less the set  [rad].
// Degenerate: as hinge.
#pragma once

#include "core/constraints/dry_friction.h"
#include "core/constraints/hinge.h"

namespace sheetbend {

// The angle from the set, which the sliding spring of friction_hinge is turned by.
struct AngleFromSet : OnPoints<4> {
  static constexpr int points = 3;
  static constexpr int rows = 1;
  static constexpr std::array parameters{Parameter{"normal_x", units::none, ranges::any, defaults::normal},
                                         Parameter{"normal_y", units::none, ranges::any, defaults::normal},
                                         Parameter{"normal_z", units::none, ranges::any, defaults::normal},
                                         Parameter{"yield", units::radians, ranges::positive, defaults::given}};

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const T about_set[] = {p[0], p[1], p[2], x[9]};
    Hinge::evaluate(x, about_set, C, J);
    J[9] = T(-1.0);
    J[10] = J[11] = T(0.0);
  }
};

struct FrictionHinge : AngleFromSet {
  static constexpr const char* name = "friction_hinge";
  static constexpr const char* about =
      "the angle of a hinge from the one it slid to, which is the x of the last particle (pinned)";
  static constexpr Unit unit = units::radians;
  static constexpr Compliance compliance = yield_over_torque;
  static constexpr bool hot = true;
  static constexpr int yield_parameter = 3;
  using Slider = AngleFromSet;

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    T e;
    AngleFromSet::evaluate(x, p, &e, J);
    slide_dry<dofs>(e, p[yield_parameter], C, J);
  }
};

}  // namespace sheetbend
