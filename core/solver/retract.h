// Directors at the end of a substep: made perpendicular to their frames' axes again and of length one,  q -> across/|across|,
// across = q - (q.t) t; normals of sections keep length one. The constraints see the directions alone, so this moves nothing; it keeps the
// coordinates well scaled and carries a frame along as its axis turns. Those that are held stay as given. And the reverse.
#pragma once

#include "core/points/kernels.h"
#include "core/scalar/across.h"
#include "core/scene/scene.h"

namespace sheetbend {

// x(node) gives where a node's coordinates are.
template <class T, class At>
Across<T> across_axis(const Director& d, At&& x) {
  const Vec3<T> axis = d.normal < 0 ? Vec3<T>(x(d.head)) - Vec3<T>(x(d.tail)) : Vec3<T>(x(d.normal));
  return {axis, Vec3<T>(x(d.node))};
}

template <class T>
void retract_directors(const Scene& scene, T* x) {
  const auto at = [&](int node) { return x + scene.first_dof[node]; };
  for (const Director& d : scene.directors) {
    if (scene.role[d.node] != Role::free) continue;
    const Vec3<T> q(at(d.node));
    (d.is_normal() ? (T(1.0) / norm(q)) * q : across_axis<T>(d, at).m1).store(at(d.node));
  }
}

// The same frames for the kernels of core/points.
inline std::vector<sheetbend_points::Frame> frames_of(const Scene& scene) {
  std::vector<sheetbend_points::Frame> frames;
  const auto at = [&](int node) { return scene.first_dof[node]; };
  for (const Director& d : scene.directors) {
    if (scene.role[d.node] != Role::free) continue;
    const bool leans = d.normal >= 0;
    frames.push_back({at(d.node), leans ? -1 : at(d.tail), at(leans ? d.normal : d.head)});
  }
  return frames;
}

// q(node) gives the coordinates before. x_bar (dofs) goes in as the cotangent of those after, and comes out as theirs. What a director
// gives to its normal, it gives to the normal before retraction, whose own cotangent stands there already.
template <class T, class At>
void retract_directors_vjp(const Scene& scene, At&& q, T* x_bar) {
  for (const Director& d : scene.directors) {
    if (scene.role[d.node] != Role::free) continue;
    T* director_bar = x_bar + scene.first_dof[d.node];
    const Vec3<T> unit_bar(director_bar);
    if (d.is_normal()) {
      const Vec3<T> n(q(d.node));
      const T inverse = T(1.0) / norm(n);
      const Vec3<T> unit = inverse * n;
      (inverse * (unit_bar - dot(unit_bar, unit) * unit)).store(director_bar);
      continue;
    }
    const Across<T> r = across_axis<T>(d, q);
    const Vec3<T> across_bar = r.inverse * (unit_bar - dot(unit_bar, r.m1) * r.m1);
    const T along_bar = -dot(across_bar, r.t);
    (across_bar + along_bar * r.t).store(director_bar);
    const Vec3<T> t_bar = along_bar * Vec3<T>(q(d.node)) - r.along * across_bar;
    const Vec3<T> axis_bar = r.inverse_length * (t_bar - dot(t_bar, r.t) * r.t);
    axis_bar.add_to(x_bar + scene.first_dof[d.normal < 0 ? d.head : d.normal]);
    if (d.normal < 0) (-axis_bar).add_to(x_bar + scene.first_dof[d.tail]);
  }
}

}  // namespace sheetbend
