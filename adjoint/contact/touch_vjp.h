// The reverse of a touch (core/contact/touch.h) and of a pose. Cotangents of ContactNumbers and of Pose stand in objects of the same types.
#pragma once

#include "adjoint/contact/law_vjp.h"
#include "core/contact/pose.h"
#include "core/contact/touch.h"

namespace sheetbend {

// Adds to the cotangents of a shape's lengths and returns that of z, given those of the distance there and of its gradient n. The derivative of n is symmetric,
// so that one direction, along n_bar, takes it back.
template <class Shape, class S>
Vec3<S> distance_vjp(const Shape& shape, const Vec3<S>& z, const S* size, const S& distance_bar, const Vec3<S>& n_bar,
                     S* size_bar) {
  constexpr int sizes = sizes_of<Shape>;
  using D = Dual<S, 1 + sizes>;
  D at[3] = {D(z.x), D(z.y), D(z.z)}, lengths[most_sizes], distance, n[3];
  at[0].d[0] = n_bar.x, at[1].d[0] = n_bar.y, at[2].d[0] = n_bar.z;
  for (int k = 0; k < sizes; ++k) lengths[k] = D(size[k]), lengths[k].d[1 + k] = S(1.0);
  distance_from(shape, at, lengths, distance, n);
  for (int k = 0; k < sizes; ++k)
    size_bar[k] +=
        distance_bar * distance.d[1 + k] + n_bar.x * n[0].d[1 + k] + n_bar.y * n[1].d[1 + k] + n_bar.z * n[2].d[1 + k];
  return {distance_bar * n[0].v + n[0].d[0], distance_bar * n[1].v + n[1].d[0], distance_bar * n[2].v + n[2].d[0]};
}

// Reverse of unit_normal: returns the cotangent of n.
template <class Shape, class S>
Vec3<S> unit_normal_vjp(const Shape& shape, const Vec3<S>& n, const Vec3<S>& bar) {
  if (!shape.grid) return bar;
  const Vec3<S> unit = unit_normal(shape, n);
  return inverse_or_zero(norm(n)) * (bar - dot(unit, bar) * unit);
}

// Adds to the cotangents of the numbers and returns that of z, given those of the force and of its tangential part.
template <class Shape, class S>
Vec3<S> touch_vjp(const Shape& shape, const Vec3<S>& z, const ContactNumbers<S>& c, const Vec3<S>& force_bar,
                  const Vec3<S>& tangential_bar, ContactNumbers<S>& bar) {
  S at[3], distance, gradient[3];
  z.store(at);
  distance_from(shape, at, c.size, distance, gradient);
  const Vec3<S> n(gradient), unit = unit_normal(shape, n);
  const Touch<S> t = touch(shape, distance, n, z, c);
  if (!any(t.pushes)) return {S(0.0), S(0.0), S(0.0)};
  const S firm(c.firm), steep = shape.grid ? norm(n) : S(1.0);
  const auto law = contact_force_vjp(firm * (distance - c.radius - c.lift), unit, z - c.from, c.carried,
                                     shape.grid ? steep * c.friction : c.friction, c.kappa,
                                     c.dissipates ? &c.loss : nullptr, dot(n, force_bar), tangential_bar + force_bar);
  Vec3<S> n_bar = t.normal * force_bar + unit_normal_vjp(shape, n, law.n);
  if (shape.grid) n_bar = n_bar + (law.friction * c.friction) * unit;
  const S distance_bar = firm * law.gap;
  bar.from = bar.from - law.slip;
  bar.carried = bar.carried + law.carried;
  bar.friction += steep * law.friction;
  bar.radius -= distance_bar;
  bar.lift -= distance_bar;
  bar.kappa += law.kappa;
  bar.loss += law.loss;
  return law.slip + distance_vjp(shape, z, c.size, distance_bar, n_bar, bar.size);
}

// Adds to the cotangents of a shape's lengths and returns that of z, given that of the unit normal there.
template <class S>
Vec3<S> normal_vjp(const AnyShape& shape, const Vec3<S>& z, const S* size, const Vec3<S>& bar, S* size_bar) {
  S at[3], distance, n[3];
  z.store(at);
  distance_from(shape, at, size, distance, n);
  return distance_vjp(shape, z, size, S(0.0), unit_normal_vjp(shape, Vec3<S>(n), bar), size_bar);
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
template <class Shape, class S>
Vec3<S> push_vjp(const Shape& shape, const Pose<S>& pose, const Vec3<S>& x, const ContactNumbers<S>& numbers,
                 const Touch<S>& at, const Vec3<S>& bar, ContactNumbers<S>& numbers_bar, Pose<S>& pose_bar) {
  const Vec3<S> none(S(0.0), S(0.0), S(0.0)), force_bar = turned_vjp(pose, at.force, bar, pose_bar);
  return in_frame_vjp(pose, x, touch_vjp(shape, pose.in_frame(x), numbers, force_bar, none, numbers_bar), pose_bar);
}

}  // namespace sheetbend
