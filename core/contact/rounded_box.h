// rounded_box: a box with the half sizes half_x, half_y, half_z whose edges and corners are rounded with a radius: the distance from the smaller box with the
// half sizes less the radius, less the radius. With q = |z| - (half - radius) that is |max(q, 0)| - radius outside the smaller box and
// max(q1, q2, q3) - radius within, where the normal belongs to the nearest face.
#pragma once

#include "core/contact/gap.h"

namespace sheetbend {

struct RoundedBox {
  static constexpr const char* name = "rounded_box";
  static constexpr const char* about = "a box around the origin of its frame with rounded edges";
  static constexpr std::array sizes{"half_x", "half_y", "half_z", "radius"};

  template <class T>
  static void evaluate(const T* z, const T* size, T& distance, T* n) {
    T q[3], sign[3], outside[3];
    int face = 0;
    bool within = true;
    for (int d = 0; d < 3; ++d) {
      sign[d] = T(z[d] < T(0.0) ? -1.0 : 1.0);
      q[d] = sign[d] * z[d] - (size[d] - size[3]);
      outside[d] = q[d] > T(0.0) ? q[d] : T(0.0);
      within = within && !(q[d] > T(0.0));
      if (q[d] > q[face]) face = d;
    }
    if (within) {
      for (int d = 0; d < 3; ++d) n[d] = d == face ? sign[d] : T(0.0);
      distance = q[face] - size[3];
      return;
    }
    distance = normalize(Vec3<T>(outside), {T(0.0), T(0.0), T(1.0)}, n) - size[3];
    for (int d = 0; d < 3; ++d) n[d] = sign[d] * n[d];
  }
};

}  // namespace sheetbend
