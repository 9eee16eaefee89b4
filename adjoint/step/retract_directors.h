// The reverse of RetractDirectors.
#pragma once

#include "adjoint/step/stages.h"
#include "core/step/retract_directors.h"

namespace sheetbend {

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

template <>
struct ReverseOf<RetractDirectors> {
  template <class T>
  using Scratch = Nothing;

  template <class T>
  static void run(const Step<T>& step, const Work<T>& work, RetractDirectors::Record<T>&, Nothing&,
                  const StepCotangents<T>& bar) {
    retract_directors_vjp<T>(step.scene, [&](int node) { return work.q.of(node); }, bar.x_next);
  }
};

}  // namespace sheetbend
