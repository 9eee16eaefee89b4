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
    const T zero(0.0), one(1.0);
    T sign[3], outside[3], face[3], nearest(0.0);  // face: the normal of the nearest face
    MaskOf<T> beyond = zero > one;
    for (int d = 0; d < 3; ++d) {
      sign[d] = select(z[d] < zero, -one, one);
      const T q = sign[d] * z[d] - (size[d] - size[3]);
      outside[d] = select(q > zero, q, zero);
      beyond = beyond | (q > zero);
      const MaskOf<T> nearer = d == 0 ? one > zero : q > nearest;
      nearest = select(nearer, q, nearest);
      for (int e = 0; e < d; ++e) face[e] = select(nearer, zero, face[e]);
      face[d] = select(nearer, sign[d], zero);
    }
    distance = select(beyond, normalize(Vec3<T>(outside), {zero, zero, one}, n), nearest) - size[3];
    for (int d = 0; d < 3; ++d) n[d] = select(beyond, sign[d] * n[d], face[d]);
  }
};

}  // namespace sheetbend
