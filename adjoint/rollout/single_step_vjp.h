// Definition of single_step_vjp, included by its instances only.
#pragma once

#include "adjoint/rollout/single_step.h"
#include "adjoint/step/substep.h"

namespace sheetbend {

template <class T>
void single_step_vjp(const Scene& scene, const Plan& plan, int step, Scenes first_order, const T* inputs,
                     const T* state, const T* next, T* next_bar, T* state_bar, T* inputs_bar) {
  const std::size_t dofs = scene.dofs();
  SubstepRecord<T> record;
  record.resize(scene, plan, true);
  SubstepScratch<T> scratch(scene, plan);
  std::vector<T> q(dofs);
  const Inputs<const T> in{scene.layout, inputs};
  const Inputs<T> in_bar{scene.layout, inputs_bar};
  const StateCotangents<T> bar{state_bar, state_bar + dofs, state_bar + 2 * dofs, state_bar + 3 * dofs};
  const Bdf bdf = first_order ? Bdf::first_order(plan.options.h) : Bdf::second_order(plan.options.h);
  const double t_next = (step + 1) * plan.options.h;
  // The next state's own history is the state itself.
  for (std::size_t i = 0; i < dofs; ++i) {
    bar.x[i] += next_bar[dofs + i];
    bar.v[i] += next_bar[3 * dofs + i];
  }
  const SubstepStates<T> from{state, state + dofs, state + 2 * dofs, state + 3 * dofs, step, next};
  try {
    substep_vjp(Step<T>{scene, plan, in, bdf, t_next, from, all_scenes<T>}, q.data(), next_bar, next_bar + 2 * dofs,
                record, scratch, bar, in_bar);
  } catch (const Unbalanced& e) {
    throw Unbalanced(e, step + 1, t_next);
  }
  finish_substeps(scene, plan, in, scratch, in_bar);
}

}  // namespace sheetbend
