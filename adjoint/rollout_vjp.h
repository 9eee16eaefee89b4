// The adjoint of a rollout: walks the tape backwards, recomputes each substep and reverses it.
#pragma once

#include "adjoint/substep_vjp.h"
#include "adjoint/tape.h"

namespace sheetbend {

// Reverses the rollout that `tape` recorded. seed(step, x_bar) adds the loss's cotangent of x at `step` (0 .. steps) to x_bar; inputs_bar (layout.total())
// receives, added, the gradient by every input. Cost: one forward substep and its reverse per substep; memory: the tape.
template <class T, class Seed>
void rollout_vjp(const Scene& scene, const Plan& plan, const T* inputs, double t0, const Tape<T>& tape, Seed&& seed,
                 T* inputs_bar, Interrupt* interrupt = nullptr) {
  const Inputs<const T> in{scene.layout, inputs};
  const Inputs<T> in_bar{scene.layout, inputs_bar};
  const std::size_t dofs = scene.dofs();
  const T* v0 = in.of(Quantity::velocity);
  // Cotangents of x and v at n+1, n and n-1, and the primal states around them.
  std::vector<T> x_next_bar(dofs), x_bar(dofs), x_before_bar(dofs), v_next_bar(dofs), v_bar(dofs), v_before_bar(dofs);
  std::vector<T> v(dofs), v_before(dofs), q(dofs), v_out(dofs);
  SubstepRecord<T> record;
  record.resize(scene, plan, true);
  ReverseScratch<T> reverse(scene, plan);

  seed(tape.steps(), x_next_bar.data());
  for (int n = tape.steps() - 1; n >= 0; --n) {
    if (interrupt && n % 64 == 0) interrupt->poll();
    seed(n, x_bar.data());
    const Bdf bdf = Bdf::at(plan.options, n);
    const double t_next = t0 + (n + 1) * plan.options.h;
    tape.velocity(n, v0, v.data());
    tape.velocity(n - 1, v0, v_before.data());
    const SubstepStates<T> states{tape.x(n), tape.x(n - 1), v.data(), v_before.data()};
    substep(scene, plan, in, bdf, t_next, states, q.data(), v_out.data(), record);
    substep_vjp(scene, plan, in, bdf, t_next, states, record, x_next_bar.data(), v_next_bar.data(), reverse,
                {x_bar.data(), x_before_bar.data(), v_bar.data(), v_before_bar.data()}, in_bar);
    std::swap(x_next_bar, x_bar);
    std::swap(x_bar, x_before_bar);
    std::fill(x_before_bar.begin(), x_before_bar.end(), T(0.0));
    std::swap(v_next_bar, v_bar);
    std::swap(v_bar, v_before_bar);
    std::fill(v_before_bar.begin(), v_before_bar.end(), T(0.0));
  }
  if constexpr (in_packs<T>) finish(scene, plan.packs, in, in_bar, reverse.packs);
  for (std::size_t b = 0; b < plan.blocks.size(); ++b)
    finish_block(scene, plan.blocks[b], in, in_bar, reverse.blocks[b]);
  // x_next_bar and v_next_bar now belong to the initial state; driven nodes started on their boundary.
  const KnotWeights boundary = scene.driven.empty() ? KnotWeights{} : scene.boundary.at(t0);
  for (int node = 0; node < scene.nodes(); ++node) {
    const int dof = scene.first_dof[node];
    if (scene.role[node] == Role::driven)
      pull_back_knots(boundary, Vec3<T>(&x_next_bar[dof]), in_bar.of(Quantity::boundary),
                      static_cast<int>(scene.driven.size()), scene.driven_slot[node]);
    else
      Vec3<T>(&x_next_bar[dof]).add_to(in_bar.of(Quantity::position) + dof);
    Vec3<T>(&v_next_bar[dof]).add_to(in_bar.of(Quantity::velocity) + dof);
  }
}

}  // namespace sheetbend
