// capsule: the distance from the segment |z3| <= half_length of the third axis, less the radius. A long one is a cylinder.
// On the segment itself the normal is the first axis.
#pragma once

#include "core/contact/gap.h"

namespace sheetbend {

struct Capsule {
  static constexpr const char* name = "capsule";
  static constexpr const char* about = "the points within a radius of a segment of the third axis of its frame";
  static constexpr std::array sizes{"radius", "half_length"};

  template <class T>
  static void evaluate(const T* z, const T* size, T& distance, T* n) {
    const T &half = size[1], zero(0.0);
    const T beyond = select(z[2] > half, z[2] - half, select(z[2] < -half, z[2] + half, zero));
    distance = normalize(Vec3<T>(z[0], z[1], beyond), {T(1.0), zero, zero}, n) - size[0];
  }
};

}  // namespace sheetbend
