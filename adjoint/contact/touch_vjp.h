// The reverse of a touch (core/contact/touch.h) and of a pose, over duals with a direction for each number that the law reads. Cotangents of
// ContactNumbers and of Pose stand in objects of the same types.
#pragma once

#include "core/contact/pose.h"
#include "core/contact/touch.h"

namespace sheetbend {

// Adds to the cotangents of the numbers and returns that of z, given those of the force and of its tangential part.
template <class S>
Vec3<S> touch_vjp(const AnyShape& shape, const Vec3<S>& z, const ContactNumbers<S>& c, const Vec3<S>& force_bar,
                  const Vec3<S>& tangential_bar, ContactNumbers<S>& bar) {
  using D = Dual<S, 13 + most_sizes>;
  int next = 0;
  const auto direct = [&](const S& a) {
    D d(a);
    d.d[next++] = S(1.0);
    return d;
  };
  const auto direct_vector = [&](const Vec3<S>& v) {
    const D x = direct(v.x), y = direct(v.y), w = direct(v.z);
    return Vec3<D>(x, y, w);
  };
  const Vec3<D> zd = direct_vector(z);
  ContactNumbers<D> cd;
  cd.from = direct_vector(c.from);
  cd.carried = direct_vector(c.carried);
  cd.friction = direct(c.friction);
  cd.radius = direct(c.radius);
  cd.kappa = direct(c.kappa);
  cd.loss = direct(c.loss);
  cd.dissipates = c.dissipates;
  for (int k = 0; k < most_sizes; ++k) cd.size[k] = direct(c.size[k]);
  cd.lift = D(c.lift);
  cd.firm = c.firm;
  const Touch<D> t = touch(shape, zd, cd);
  if (!t.pushes) return {S(0.0), S(0.0), S(0.0)};
  next = 0;
  const auto back = [&] {
    const int i = next++;
    return force_bar.x * t.force.x.d[i] + force_bar.y * t.force.y.d[i] + force_bar.z * t.force.z.d[i] +
           tangential_bar.x * t.tangential.x.d[i] + tangential_bar.y * t.tangential.y.d[i] +
           tangential_bar.z * t.tangential.z.d[i];
  };
  const auto back_vector = [&] {
    const S x = back(), y = back(), w = back();
    return Vec3<S>(x, y, w);
  };
  const Vec3<S> z_bar = back_vector();
  bar.from = bar.from + back_vector();
  bar.carried = bar.carried + back_vector();
  bar.friction += back();
  const S nearer = back();
  bar.radius += nearer;
  bar.lift += nearer;
  bar.kappa += back();
  bar.loss += back();
  for (int k = 0; k < most_sizes; ++k) bar.size[k] += back();
  return z_bar;
}

// Adds to the cotangents of a shape's lengths and returns that of z, given that of the normal there.
template <class S>
Vec3<S> normal_vjp(const AnyShape& shape, const Vec3<S>& z, const S* size, const Vec3<S>& n_bar, S* size_bar) {
  using D = Dual<S, 3 + most_sizes>;
  D at[3] = {D(z.x), D(z.y), D(z.z)}, lengths[most_sizes];
  for (int d = 0; d < 3; ++d) at[d].d[d] = S(1.0);
  for (int k = 0; k < most_sizes; ++k) lengths[k] = D(size[k]), lengths[k].d[3 + k] = S(1.0);
  const Vec3<D> n = normal_at(shape, Vec3<D>(at), lengths);
  const auto back = [&](int i) { return n_bar.x * n.x.d[i] + n_bar.y * n.y.d[i] + n_bar.z * n.z.d[i]; };
  for (int k = 0; k < most_sizes; ++k) size_bar[k] += back(3 + k);
  return {back(0), back(1), back(2)};
}

// Compiled once (contact_vjp.cpp), for scenes by themselves and in lanes.
extern template Vec3<double> touch_vjp(const AnyShape&, const Vec3<double>&, const ContactNumbers<double>&,
                                       const Vec3<double>&, const Vec3<double>&, ContactNumbers<double>&);
extern template Vec3<double> normal_vjp(const AnyShape&, const Vec3<double>&, const double*, const Vec3<double>&,
                                        double*);

// turn_bar += world frame^T
template <class S>
void add_outer(const Vec3<S>& world, const Vec3<S>& frame, S* turn_bar) {
  S w[3], f[3];
  world.store(w), frame.store(f);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) turn_bar[3 * a + b] += w[a] * f[b];
}

// Reverse of Pose::in_frame: returns the cotangent of the point.
template <class S>
Vec3<S> in_frame_vjp(const Pose<S>& pose, const Vec3<S>& point, const Vec3<S>& z_bar, Pose<S>& bar) {
  const Vec3<S> point_bar = pose.turned(z_bar);
  bar.position = bar.position - point_bar;
  add_outer(point - pose.position, z_bar, bar.turn);
  return point_bar;
}

// Reverse of Pose::turned: returns the cotangent of the vector.
template <class S>
Vec3<S> turned_vjp(const Pose<S>& pose, const Vec3<S>& v, const Vec3<S>& bar, Pose<S>& pose_bar) {
  add_outer(bar, v, pose_bar.turn);
  return pose.turned_back(bar);
}

// Reverse of turn_by: returns the cotangent of the rotation vector.
template <class S>
Vec3<S> turn_by_vjp(const Vec3<S>& r, const S* turn_bar) {
  using D = Dual<S, 3>;
  D at[3] = {D(r.x), D(r.y), D(r.z)}, turn[9];
  for (int d = 0; d < 3; ++d) at[d].d[d] = S(1.0);
  turn_by(Vec3<D>(at), turn);
  S r_bar[3] = {S(0.0), S(0.0), S(0.0)};
  for (int k = 0; k < 9; ++k)
    for (int d = 0; d < 3; ++d) r_bar[d] += turn_bar[k] * turn[k].d[d];
  return Vec3<S>(r_bar);
}

// Reverse of a contact's force on a point at x, both in the world's frame: adds to the cotangents of the numbers and of the pose, and returns that of x.
// `at` is the touch there.
template <class S>
Vec3<S> push_vjp(const AnyShape& shape, const Pose<S>& pose, const Vec3<S>& x, const ContactNumbers<S>& numbers,
                 const Touch<S>& at, const Vec3<S>& bar, ContactNumbers<S>& numbers_bar, Pose<S>& pose_bar) {
  const Vec3<S> none(S(0.0), S(0.0), S(0.0)), force_bar = turned_vjp(pose, at.force, bar, pose_bar);
  return in_frame_vjp(pose, x, touch_vjp(shape, pose.in_frame(x), numbers, force_bar, none, numbers_bar), pose_bar);
}

}  // namespace sheetbend
