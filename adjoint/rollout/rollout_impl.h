// Definitions of rollout.h, included by its instances only.
#pragma once

#include "adjoint/rollout/rollout.h"
#include "adjoint/rollout/rollout_vjp.h"

namespace sheetbend {

template <class T>
void rollout_states(const Scene& scene, const Plan& plan, const T* inputs, double t0, const std::vector<int>& wanted,
                    T* states, Interrupt* interrupt) {
  Rollout<T> rollout(scene, plan, inputs, t0);
  auto next = wanted.begin();
  const auto write = [&](int step, const T* x, const T*) {
    for (; next != wanted.end() && *next == step; ++next) states = std::copy_n(x, scene.dofs(), states);
  };
  rollout.run(wanted.back(), write, interrupt);
}

template <class T>
Tape<T> record_rollout(const Scene& scene, const Plan& plan, const T* inputs, double t0, const std::vector<int>& wanted,
                       T* states, int kept, Interrupt* interrupt) {
  const int steps = wanted.back();
  Tape<T> tape(scene, plan, steps, kept);
  std::vector<char> keep(steps + 1, 0);
  keep[0] = 1;
  if (tape.keeps_end()) keep[steps] = 1;
  Schedule schedule = tape.schedule();
  for (auto action = schedule.next(); action && std::holds_alternative<Advance>(*action); action = schedule.next()) {
    const Advance& advance = std::get<Advance>(*action);
    std::fill(keep.begin() + advance.keep, keep.begin() + advance.to + 1, 1);
  }
  Rollout<T> rollout(scene, plan, inputs, t0);
  auto next = wanted.begin();
  const auto write = [&](int step, const T* x, const T*) {
    if (step > 0) {
      tape.record_first_order(step - 1, rollout.first_order());
      tape.record_bounced(step, rollout.bounced());
    }
    if (keep[step]) tape.record(step, x);
    for (; next != wanted.end() && *next == step; ++next) states = std::copy_n(x, scene.dofs(), states);
  };
  rollout.run(steps, write, interrupt);
  return tape;
}

template <class T>
long reverse_rollout(const Scene& scene, const Plan& plan, const T* inputs, double t0, Tape<T>& tape,
                     const std::vector<int>& wanted, const T* x_bar, T* inputs_bar, Interrupt* interrupt) {
  const std::size_t dofs = scene.dofs();
  std::size_t left = wanted.size();
  CotangentGrowth<T> growth;
  const auto seed = [&](int step, T* bar) {
    for (; left > 0 && wanted[left - 1] == step; --left) {
      const T* own = x_bar + (left - 1) * dofs;
      growth.seed(own, dofs);
      for (std::size_t i = 0; i < dofs; ++i) bar[i] += own[i];
    }
  };
  return rollout_vjp<T>(scene, plan, inputs, t0, tape, seed, growth, inputs_bar, interrupt);
}

}  // namespace sheetbend
