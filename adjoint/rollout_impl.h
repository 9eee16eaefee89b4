// Definitions of rollout.h, included by its instances only.
#pragma once

#include "adjoint/rollout.h"

namespace sheetbend {

template <class T>
Tape<T> record_rollout(const Scene& scene, const Plan& plan, const T* inputs, double t0, int steps,
                       Interrupt* interrupt) {
  Tape<T> tape(scene, plan, steps);
  Rollout<T> rollout(scene, plan, inputs, t0);
  rollout.run(steps, [&](int step, const T* x, const T*) { tape.record(step, x); }, interrupt);
  return tape;
}

template <class T>
void reverse_rollout(const Scene& scene, const Plan& plan, const T* inputs, double t0, const Tape<T>& tape,
                     const std::vector<int>& wanted, const T* x_bar, T* inputs_bar, Interrupt* interrupt) {
  const std::size_t dofs = scene.dofs();
  std::size_t left = wanted.size();
  const auto seed = [&](int step, T* bar) {
    for (; left > 0 && wanted[left - 1] == step; --left)
      for (std::size_t i = 0; i < dofs; ++i) bar[i] += x_bar[(left - 1) * dofs + i];
  };
  rollout_vjp<T>(scene, plan, inputs, t0, tape, seed, inputs_bar, interrupt);
}

}  // namespace sheetbend
