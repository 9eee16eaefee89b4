// shear: C = (t . m1, t . m2), the sines of the angles by which an edge of direction t leans in the frame of its section, whose axis is the
// section's normal n  [-]. Zero where the section lies across the edge.
// Compliance alpha = 1 / (GA l) [1/(N m)], l the edge's length and GA = kappa G A the shear stiffness [N], gives the energy GA l |C|^2 / 2: a
// beam of Timoshenko, where bending and twist are measured between sections (material_frame.h). The stencil: two points, n, the director q.
// Degenerate: an edge or a normal without length, a director along the normal.
#pragma once

#include "core/constraints/material_frame.h"

namespace sheetbend {

struct Shear : OnPoints<4> {
  static constexpr const char* name = "shear";
  static constexpr const char* about = "the sines of the angles by which an edge leans against its section";
  static constexpr Unit unit = units::none;
  static constexpr Compliance compliance{"1 / (GA link length)"};
  static constexpr int points = 2;
  static constexpr int rows = 2;
  static constexpr std::array<Parameter, 0> parameters{};

  template <class T>
  static void evaluate(const T* x, const T*, T* C, T* J) {
    const Vec3<T> edge = Vec3<T>(x + 3) - Vec3<T>(x);
    const T inverse_length = T(1.0) / norm(edge);
    const Vec3<T> t = inverse_length * edge;
    const MaterialFrame<T> section(Vec3<T>(x + 6), Vec3<T>(x + 9));
    C[0] = dot(t, section.m1);
    C[1] = dot(t, section.m2);

    // d(t . m) = m . dt + turned d(angle of the frame) - (t . n) m . dn, as the frame tilts with its axis
    const T tilt = -(dot(t, section.t) * section.inverse_length);
    const auto row = [&](const Vec3<T>& m, const T& c, const T& turned, T* to) {
      const Vec3<T> by_edge = inverse_length * (m - c * t);
      (-by_edge).store(to);
      by_edge.store(to + 3);
      (turned * section.by_axis + tilt * m).store(to + 6);
      (turned * section.by_director).store(to + 9);
    };
    row(section.m1, C[0], C[1], J);
    row(section.m2, C[1], -C[0], J + dofs);
  }
};

}  // namespace sheetbend
