// plane: distance = z3, the plane through the origin of its frame with the third axis as normal. What is below is inside.
#pragma once

#include "core/contact/gap.h"

namespace sheetbend {

struct Plane {
  static constexpr const char* name = "plane";
  static constexpr const char* about = "the half space below the first two axes of its frame";
  static constexpr std::array<const char*, 0> sizes{};

  template <class T>
  static void evaluate(const T* z, const T*, T& distance, T* n) {
    distance = z[2];
    n[0] = n[1] = T(0.0);
    n[2] = T(1.0);
  }
};

}  // namespace sheetbend
