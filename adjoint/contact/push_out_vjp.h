// The reverse of where a contact puts its particle, x = y + w F(x) (core/contact/balanced.h), over any scalar. With the cotangents x_bar and F_bar,
//
//   s = (I - w dF/dx)^-T (F_bar + w x_bar),   y_bar = x_bar + (dF/dx)^T s,   and s goes through F to what the law reads.
//
// x, y, s and their cotangents are in the world's frame, the law in the collider's.
#pragma once

#include "adjoint/contact/touch_vjp.h"
#include "core/contact/balanced.h"

namespace sheetbend {

// Returns (dF/dx)^T s, given `bar` = F_bar + w x_bar. Adds to the cotangents of the numbers and of the pose.
template <class Shape, class S>
Vec3<S> push_out_vjp(const Shape& shape, const Pose<S>& pose, const Vec3<S>& x, const S& w,
                     const ContactNumbers<S>& numbers, const Vec3<S>& bar, ContactNumbers<S>& numbers_bar,
                     Pose<S>& pose_bar) {
  const Vec3<S> z = pose.in_frame(x);
  const Touch<S> at = touch(shape, z, numbers);
  const auto inverse = balance_inverse(shape, z, w, numbers);
  const auto solved = [&](const Vec3<S>& v) { return pose.turned(inverse.transposed_times(pose.turned_back(v))); };
  Vec3<S> s = solved(bar);
  if (numbers.firm > 1.0) {  // the inverse loses digits then: one step of iterative refinement
    ContactNumbers<S> unused{};
    Pose<S> unused_pose{};
    s = s + solved(bar - s + w * push_vjp(shape, pose, x, numbers, at, s, unused, unused_pose));
  }
  return push_vjp(shape, pose, x, numbers, at, s, numbers_bar, pose_bar);
}

}  // namespace sheetbend
