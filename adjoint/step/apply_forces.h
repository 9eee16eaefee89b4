// The reverse of ApplyForces.
#pragma once

#include "adjoint/step/stages.h"
#include "core/step/apply_forces.h"

namespace sheetbend {

template <>
struct ReverseOf<ApplyForces> {
  template <class T>
  using Scratch = Nothing;

  template <class T>
  static void run(const Step<T>& step, const Work<T>& work, Nothing&, Nothing&, const StepCotangents<T>& bar) {
    const Scene& scene = step.scene;
    if (scene.loaded.empty()) return;
    const ForceImpulses<T> impulses(step);
    const T eta(step.bdf.eta);
    const int slots = static_cast<int>(scene.loaded.size());
    for (int i = 0; i < slots; ++i) {
      const int n = scene.loaded[i];
      if (!scene.inertial[n]) continue;
      const Vec3<T> v_star_bar = eta * Vec3<T>(bar.q.of(n));
      pull_back_knots(impulses.knots, (eta * work.masses.w[n]) * v_star_bar, bar.in.of(Quantity::force), slots, i);
      bar.w_of_forces[i] = dot(impulses.of(i), v_star_bar);
    }
  }
};

}  // namespace sheetbend
