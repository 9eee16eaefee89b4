// A director q against the direction t of its edge: along = q.t, and m1, the unit vector of its part across the edge, q - along t.
// Degenerate: an edge without length, a director along its edge.
#pragma once

#include "core/scalar/vec3.h"

namespace sheetbend {

template <class T>
struct Across {
  Vec3<T> t, m1;
  T inverse_length, along, inverse;  // of the edge; of the part across

  Across(const Vec3<T>& edge, const Vec3<T>& q) {
    inverse_length = T(1.0) / norm(edge);
    t = inverse_length * edge;
    along = dot(q, t);
    const Vec3<T> across = q - along * t;
    inverse = T(1.0) / norm(across);
    m1 = inverse * across;
  }
};

}  // namespace sheetbend
