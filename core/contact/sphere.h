// sphere: distance = |z| - radius. At the center the normal is the third axis.
#pragma once

#include "core/contact/gap.h"

namespace sheetbend {

struct Sphere {
  static constexpr const char* name = "sphere";
  static constexpr const char* about = "the points within a radius of the origin of its frame";
  static constexpr std::array sizes{"radius"};

  template <class T>
  static void evaluate(const T* z, const T* size, T& distance, T* n) {
    distance = normalize(Vec3<T>(z), {T(0.0), T(0.0), T(1.0)}, n) - size[0];
  }
};

}  // namespace sheetbend
