// Where a collider's frame is: a position and a rotation, from the poses at its knots. A rotation is interpolated as a vector along its axis, as long as
// its angle, so that a turn about one axis is exact whatever its angle.
#pragma once

#include "core/scalar/vec3.h"

namespace sheetbend {

// The frame's axes are the columns of `turn`, row by row.
template <class T>
struct Pose {
  Vec3<T> position;
  T turn[9];

  Vec3<T> turned(const Vec3<T>& v) const {
    return {turn[0] * v.x + turn[1] * v.y + turn[2] * v.z, turn[3] * v.x + turn[4] * v.y + turn[5] * v.z,
            turn[6] * v.x + turn[7] * v.y + turn[8] * v.z};
  }
  Vec3<T> turned_back(const Vec3<T>& v) const {
    return {turn[0] * v.x + turn[3] * v.y + turn[6] * v.z, turn[1] * v.x + turn[4] * v.y + turn[7] * v.z,
            turn[2] * v.x + turn[5] * v.y + turn[8] * v.z};
  }
  Vec3<T> in_frame(const Vec3<T>& point) const { return turned_back(point - position); }
};

// Rodrigues' rotation I + a [r] + b [r]^2 with a = sin|r|/|r| and b = (1 - cos|r|)/|r|^2; by their series near zero.
template <class T>
void turn_by(const Vec3<T>& r, T* turn) {
  const T squared = dot(r, r);
  T a, b;
  if (value_of(squared) < 1e-3) {
    a = T(1.0) + squared * (T(-1.0 / 6.0) +
                            squared * (T(1.0 / 120.0) + squared * (T(-1.0 / 5040.0) + squared * T(1.0 / 362880.0))));
    b = T(0.5) + squared * (T(-1.0 / 24.0) +
                            squared * (T(1.0 / 720.0) + squared * (T(-1.0 / 40320.0) + squared * T(1.0 / 3628800.0))));
  } else {
    const T angle = sqrt(squared);
    a = sin(angle) / angle;
    b = (T(1.0) - cos(angle)) / squared;
  }
  const T c = T(1.0) - b * squared;
  turn[0] = c + b * r.x * r.x, turn[1] = b * r.x * r.y - a * r.z, turn[2] = b * r.x * r.z + a * r.y;
  turn[3] = b * r.x * r.y + a * r.z, turn[4] = c + b * r.y * r.y, turn[5] = b * r.y * r.z - a * r.x;
  turn[6] = b * r.x * r.z - a * r.y, turn[7] = b * r.y * r.z + a * r.x, turn[8] = c + b * r.z * r.z;
}

}  // namespace sheetbend
