// twist: C = angle of twist at a vertex between two edges - rest  [rad].
// Compliance alpha = l / GJ [1/(N m)] with the Voronoi length l gives the energy GJ twist^2 / (2 l) (Bergou et al. 2008, eq. 4), so a straight
// rod turns by M L / GJ. The angle is periodic: a joint can hold less than half a turn. Degenerate as material_frame.h says.
// section_twist: the same between two sections.
#pragma once

#include "core/constraints/material_frame.h"

namespace sheetbend {

template <class Stencil>
struct TwistOfFrames : Stencil {
  static constexpr Unit unit = units::radians;
  static constexpr Compliance compliance{"Voronoi length / GJ"};
  static constexpr int rows = 1;
  static constexpr std::array parameters{Parameter{"rest", units::radians, ranges::any, defaults::usually(0.0)}};
  static constexpr int offsets = 1;
  static constexpr bool periodic = true;

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const Joint<Stencil, T> joint(x);
    C[0] = difference<TwistOfFrames>(atan2(joint.sine, joint.cosine), p[0]);
    joint.store(joint.transport(joint.first) - joint.first.by_axis,
                joint.transport(joint.second) + joint.second.by_axis, -joint.first.by_director,
                joint.second.by_director, J);
  }
};

struct Twist : TwistOfFrames<OnJoint> {
  static constexpr const char* name = "twist";
  static constexpr const char* about = "the angle of twist between two edges of a rod, less a rest angle";
  static constexpr bool hot = true;
};

struct SectionTwist : TwistOfFrames<OnSections> {
  static constexpr const char* name = "section_twist";
  static constexpr const char* about =
      "the angle of twist between two sections of a rod that shears, less a rest angle";
};

}  // namespace sheetbend
