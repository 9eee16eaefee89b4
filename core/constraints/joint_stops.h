// angle_stop, slide_stop: how far a joint has gone beyond its range (beyond_range.h): its angle (joint_angle.h), or its shift along a direction (along.h).
// The angle is periodic. Halfway around from the middle of its range it goes over from one limit to the other.
// Stencils: (a1, a2, a3, b1, b2, b3); (p, q, a1, a2, a3, b1, b2, b3). Degenerate: as joint_angle and beyond_range.h.
#pragma once

#include "core/constraints/along.h"
#include "core/constraints/beyond_range.h"
#include "core/constraints/joint_angle.h"

namespace sheetbend {

struct AngleStop : AboutHinge<BeyondRange<Turn, 3>> {
  static constexpr const char* name = "angle_stop";
  static constexpr const char* about =
      "how far the angle of one body against another about a hinge lies beyond a range";
  static constexpr Compliance compliance{
      "angle / torque", Compliance::scalar,
      "within its range a stop has no gradient; give the angle by which it gives way per torque"};
};

struct SlideStop : AlongDirection<BeyondRange<Progress, 3>> {
  static constexpr const char* name = "slide_stop";
  static constexpr const char* about =
      "how far a point of the second body lies, along a direction of the first, beyond a range from a point of the "
      "first";
  static constexpr Compliance compliance{
      "displacement / force", Compliance::scalar,
      "within its range a stop has no gradient; give the distance by which it gives way per force"};
};

}  // namespace sheetbend
