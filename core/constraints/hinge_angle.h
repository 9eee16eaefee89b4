// The angle between two triangles (x0, x1, a) and (x1, x0, b) that share the edge x0x1, and its gradient: zero when flat, positive where their
// normals lean towards each other; by atan2, never acos (Bridson et al. 2003; gradient: Tamstorf & Grinspun 2013).
// Degenerate: a triangle without area.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

template <class T>
struct HingeAngle {
  T value;
  Vec3<T> by_x0, by_x1, by_a, by_b;

  HingeAngle(const Vec3<T>& x0, const Vec3<T>& x1, const Vec3<T>& a, const Vec3<T>& b) {
    const Vec3<T> e = x1 - x0, to_a = a - x0, to_b = b - x0;
    const Vec3<T> normal_a = cross(e, to_a), normal_b = cross(to_b, e);
    const T length2 = dot(e, e), length = sqrt(length2), inverse = T(1.0) / length2;
    value = atan2(length * dot(normal_a, to_b), dot(normal_a, normal_b));
    by_a = (length / dot(normal_a, normal_a)) * normal_a;
    by_b = (length / dot(normal_b, normal_b)) * normal_b;
    const T foot_a = dot(to_a, e) * inverse, foot_b = dot(to_b, e) * inverse;  // of the heights, along the edge
    by_x1 = -(foot_a * by_a) - foot_b * by_b;
    by_x0 = -by_x1 - by_a - by_b;
  }
};

}  // namespace sheetbend
