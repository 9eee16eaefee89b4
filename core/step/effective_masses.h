// The masses that a substep's projections see.
#pragma once

#include "core/scene/wind.h"
#include "core/step/stages.h"

namespace sheetbend {

// Drag c = c1 + c2 |v| is implicit: it adds eta c to the mass, so the reaction of the constraints feels it. v is relative to the wind, where
// there is one.
struct ComputeEffectiveMasses {
  static constexpr bool repeated = true;
  template <class T>
  using Record = InverseMasses<T>;

  template <class T>
  static void forward(const Step<T>& step, Work<T>&, Record<T>& masses) {
    compute(step, masses);
  }

  template <class T>
  static void compute(const Step<T>& step, InverseMasses<T>& masses) {
    const Scene& scene = step.scene;
    if (masses.eta != step.bdf.eta) {
      masses.eta = step.bdf.eta;
      const T* mass = step.in.of(Quantity::mass);
      const T eta(step.bdf.eta);
      for (int n = 0; n < scene.nodes(); ++n)
        masses.w[n] = scene.inertial[n]             ? T(1.0) / mass[n]
                      : scene.role[n] == Role::free ? T(1.0) / (mass[n] * eta * eta)
                                                    : T(0.0);
    }
    if (scene.drag_in_wind) masses.wind = wind_at(scene, step.in, step.t_next);
    if (scene.has_drag) point_kernels<T>().effective_masses(points_of(step, masses), 0, scene.nodes());
  }
};

}  // namespace sheetbend
