// The reverse of UpdateVelocities: what arrives at the end goes on to the corrected coordinates.
#pragma once

#include "adjoint/step/stages.h"
#include "core/step/update_velocities.h"

namespace sheetbend {

template <>
struct ReverseOf<UpdateVelocities> {
  // The cotangents of the coordinates. Where colors go through kernels, they stand in their rows.
  template <class T>
  struct Scratch {
    std::vector<T> q;

    void resize(const Scene& scene, const Plan& plan) {
      if (!sweeps_packs<T>(plan)) q.resize(scene.dofs());
    }
    static std::size_t bytes(const Scene& scene, const Plan& plan) {
      return sweeps_packs<T>(plan) ? 0 : sizeof(T) * scene.dofs();
    }
  };

  template <class T>
  static void run(const Step<T>& step, const Work<T>&, Nothing&, Scratch<T>&, const StepCotangents<T>& cotangents) {
    const T rate(1.0 / step.bdf.eta);
    const Bdf bdf = step.bdf;
    const int* first_dof = step.scene.first_dof.data();
    const Coordinates<T> q_bar = cotangents.q;
    const StateCotangents<T> bar = cotangents.from;
    const T *x_next_bar = cotangents.x_next, *v_next_bar = cotangents.v_next;
    parallel_for(step.scene.nodes(), step.threads(), points_per_thread, [=](int begin, int end) {
      for_each_point<T>(begin, end, [=](int n, auto how) {
        const int dof = first_dof[n];
        const auto back = scaled(rate, how.load(v_next_bar + dof));
        how.store(q_bar.of(n), how.load(x_next_bar + dof) + back);
        pull_back_history(bdf, how, -back, bar.x + dof, bar.x_before + dof);
      });
    });
  }
};

}  // namespace sheetbend
