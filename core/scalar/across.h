// A director q against the direction t of its frame's axis: along = q.t, and m1, the unit vector of its part across, q - along t.
// Degenerate: an axis without length, a director along it.
#pragma once

#include "core/scalar/vec3.h"

namespace sheetbend {

template <class T>
struct Across {
  Vec3<T> t, m1;
  T inverse_length, along, inverse;  // of the axis; of the part across

  Across(const Vec3<T>& axis, const Vec3<T>& q) {
    inverse_length = 1.0 / norm(axis);
    t = inverse_length * axis;
    along = dot(q, t);
    const Vec3<T> across = q - along * t;
    inverse = 1.0 / norm(across);
    m1 = inverse * across;
  }
};

}  // namespace sheetbend
