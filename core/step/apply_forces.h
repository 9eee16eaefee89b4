// The forces f(t) on particles, given at knots: they add w eta f to the predicted velocities, so eta times that to the predicted coordinates.
#pragma once

#include "core/step/stages.h"

namespace sheetbend {

// eta f of what is loaded, at the substep's end.
template <class T>
struct ForceImpulses {
  const Step<T>& step;
  KnotWeights knots;

  explicit ForceImpulses(const Step<T>& step_) : step(step_), knots(step_.scene.force.at(step_.t_next)) {}
  Vec3<T> of(int slot) const {
    return T(step.bdf.eta) *
           at_knots(knots, step.in.of(Quantity::force), static_cast<int>(step.scene.loaded.size()), slot);
  }
};

struct ApplyForces {
  static constexpr bool repeated = true;
  template <class T>
  using Record = Nothing;

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Nothing&) {
    const Scene& scene = step.scene;
    if (scene.loaded.empty()) return;
    const ForceImpulses<T> impulses(step);
    const T eta(step.bdf.eta);
    for (std::size_t i = 0; i < scene.loaded.size(); ++i) {
      const int n = scene.loaded[i];
      if (scene.inertial[n]) (eta * (work.masses.w[n] * impulses.of(static_cast<int>(i)))).add_to(work.q.of(n));
    }
  }
};

}  // namespace sheetbend
