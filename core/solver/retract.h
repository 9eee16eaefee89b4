// Directors at the end of a substep: made perpendicular to their edges again and of length one,  q -> across/|across|,
// across = q - (q.t) t. The constraints see the direction across the edge alone, so this moves nothing; it keeps the coordinates well scaled
// and carries a frame along as its edge turns. Those that are held stay as given. And the reverse.
#pragma once

#include "core/scalar/across.h"
#include "core/scene/scene.h"

namespace sheetbend {

// x(node) gives where a node's coordinates are.
template <class T, class At>
Across<T> across_edge(const Director& d, At&& x) {
  return {Vec3<T>(x(d.head)) - Vec3<T>(x(d.tail)), Vec3<T>(x(d.node))};
}

template <class T>
void retract_directors(const Scene& scene, T* x) {
  const auto at = [&](int node) { return x + scene.first_dof[node]; };
  for (const Director& d : scene.directors)
    if (scene.role[d.node] == Role::free) across_edge<T>(d, at).m1.store(at(d.node));
}

// q(node) gives the coordinates before. x_bar (dofs) goes in as the cotangent of those after, and comes out as theirs.
template <class T, class At>
void retract_directors_vjp(const Scene& scene, At&& q, T* x_bar) {
  for (const Director& d : scene.directors) {
    if (scene.role[d.node] != Role::free) continue;
    const Across<T> r = across_edge<T>(d, q);
    T* director_bar = x_bar + scene.first_dof[d.node];
    const Vec3<T> unit_bar(director_bar);
    const Vec3<T> across_bar = r.inverse * (unit_bar - dot(unit_bar, r.m1) * r.m1);
    const T along_bar = -dot(across_bar, r.t);
    (across_bar + along_bar * r.t).store(director_bar);
    const Vec3<T> t_bar = along_bar * Vec3<T>(q(d.node)) - r.along * across_bar;
    const Vec3<T> edge_bar = r.inverse_length * (t_bar - dot(t_bar, r.t) * r.t);
    edge_bar.add_to(x_bar + scene.first_dof[d.head]);
    (-edge_bar).add_to(x_bar + scene.first_dof[d.tail]);
  }
}

}  // namespace sheetbend
