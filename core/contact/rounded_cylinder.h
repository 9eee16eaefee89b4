// rounded_cylinder: a cylinder around the third axis, |z3| <= half_length, whose two rims are rounded with a radius; a flat one is a disk. With the distance
// rho from the axis and q = (rho - (radius - edge_radius), |z3| - (half_length - edge_radius)) the distance is that of rounded_box.h: |max(q, 0)| - edge_radius
// outside the smaller cylinder that has no rounding, and max(q1, q2) - edge_radius within, where the normal belongs to the nearer of side and end.
// On the axis the side's normal is the first axis.
#pragma once

#include "core/contact/gap.h"

namespace sheetbend {

struct RoundedCylinder {
  static constexpr const char* name = "rounded_cylinder";
  static constexpr const char* about = "a cylinder around the third axis of its frame with rounded rims";
  static constexpr std::array sizes{"radius", "half_length", "edge_radius"};

  template <class T>
  static void evaluate(const T* z, const T* size, T& distance, T* n) {
    const T zero(0.0), one(1.0), sign = select(z[2] < zero, -one, one);
    T side[3], q[3];  // the directions of growing q: the side's normal, and the third axis times the sign
    const T from_axis = normalize(Vec3<T>(z[0], z[1], zero), {one, zero, zero}, side);
    q[0] = from_axis - (size[0] - size[2]);
    q[1] = sign * z[2] - (size[1] - size[2]);
    T share[3];
    const Vec3<T> outside(select(q[0] > zero, q[0], zero), select(q[1] > zero, q[1], zero), zero);
    const auto beyond = (q[0] > zero) | (q[1] > zero);
    const auto end = q[1] > q[0];
    distance = select(beyond, normalize(outside, {one, zero, zero}, share), select(end, q[1], q[0])) - size[2];
    share[0] = select(beyond, share[0], select(end, zero, one));
    share[1] = select(beyond, share[1], select(end, one, zero));
    n[0] = share[0] * side[0], n[1] = share[0] * side[1], n[2] = share[1] * sign;
  }
};

}  // namespace sheetbend
