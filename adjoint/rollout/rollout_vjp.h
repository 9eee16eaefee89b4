// The adjoint of a rollout: follows the tape's schedule backwards, recomputes each substep and reverses it.
#pragma once

#include <optional>

#include "adjoint/rollout/growth.h"
#include "adjoint/step/substep.h"
#include "adjoint/tape/tape.h"

namespace sheetbend {

// Cotangents of the states at n+1, n and n-1, and the reverse of the substep between the first two.
template <class T, class List = Substep>
class StateReverse {
 public:
  std::vector<T> x_next_bar, v_next_bar;

  StateReverse(const Scene& scene, const Plan& plan)
      : scene_(scene), plan_(plan), record_(whole(scene, plan)), scratch_(scene, plan) {
    for (auto* buffer : {&x_next_bar, &v_next_bar, &x_bar_, &v_bar_, &x_before_bar_, &v_before_bar_, &q_})
      buffer->resize(scene.dofs());
    if (Tape<T>::ends(plan)) x_next_.resize(scene.dofs());
  }

  // The coordinates at the end of the last step.
  void end_at(const T* x) {
    if (!x_next_.empty()) std::copy_n(x, x_next_.size(), x_next_.data());
  }

  // From step n + 1 to n, which went with BDF1 in the scenes `first_order`; seed adds the loss's cotangent at n.
  template <class Seed>
  void step(int n, Scenes first_order, const Inputs<const T>& in, double t_next, SubstepStates<T> states, Seed&& seed,
            const Inputs<T>& in_bar) {
    if (!x_next_.empty()) states.x_next = x_next_.data();
    seed(n, x_bar_.data());
    try {
      for_each_formula(first_order, [&](const Bdf& bdf, Scenes scenes) {
        const Step<T> step{scene_, plan_, in, bdf, t_next, states, scenes};
        substep_vjp(step, q_.data(), x_next_bar.data(), v_next_bar.data(), record_, scratch_,
                    {x_bar_.data(), x_before_bar_.data(), v_bar_.data(), v_before_bar_.data()}, in_bar);
      });
    } catch (const Unbalanced& e) {
      throw Unbalanced(e, n + 1, t_next);
    }
    shift(x_next_bar, x_bar_, x_before_bar_);
    shift(v_next_bar, v_bar_, v_before_bar_);
    end_at(states.x);
  }

  void finish(const Inputs<const T>& in, const Inputs<T>& in_bar) {
    finish_substeps(scene_, plan_, in, scratch_, in_bar);
  }

 private:
  // Calls reverse(bdf, scenes) for all scenes, or where they went with different formulas once for either, with the cotangents of the others zero.
  template <class F>
  void for_each_formula(Scenes first, F&& reverse) {
    constexpr Scenes all = all_scenes<T>;
    const Bdf one = Bdf::first_order(plan_.options.h), two = Bdf::second_order(plan_.options.h);
    if (first == all) return reverse(one, all);
    if (first == 0) return reverse(two, all);
    const std::vector<T> x_bar = x_next_bar, v_bar = v_next_bar;
    const auto take = [&](const Bdf& bdf, Scenes scenes) {
      for (std::size_t i = 0; i < x_bar.size(); ++i) {
        x_next_bar[i] = chosen(scenes, x_bar[i], T(0.0));
        v_next_bar[i] = chosen(scenes, v_bar[i], T(0.0));
      }
      reverse(bdf, scenes);
    };
    take(one, first);
    take(two, all ^ first);
  }

  static SubstepRecord<T, List> whole(const Scene& scene, const Plan& plan) {
    SubstepRecord<T, List> record;
    record.resize(scene, plan, true);
    return record;
  }

  void shift(std::vector<T>& next, std::vector<T>& now, std::vector<T>& before) const {
    std::swap(next, now);
    std::swap(now, before);
    parallel_for(static_cast<int>(before.size()), plan_.options.threads, 3 * points_per_thread,
                 [&](int begin, int end) { std::fill(before.begin() + begin, before.begin() + end, T(0.0)); });
  }

  const Scene& scene_;
  const Plan& plan_;
  std::vector<T> x_bar_, v_bar_, x_before_bar_, v_before_bar_, q_;
  std::vector<T> x_next_;  // where the step to be reversed ends; empty where it is recomputed
  SubstepRecord<T, List> record_;
  SubstepScratch<T, List> scratch_;
};

// Cotangents of the initial state to those of the inputs: driven nodes started on their boundary.
template <class T>
void initial_state_vjp(const Scene& scene, const Inputs<const T>& in, double t0, T* x_bar, T* v_bar,
                       const Inputs<T>& in_bar) {
  start_spins_vjp(scene, in.of(Quantity::mass), in.of(Quantity::position), in.of(Quantity::velocity), x_bar, v_bar,
                  in_bar.of(Quantity::mass));
  const KnotWeights boundary = scene.driven.empty() ? KnotWeights{} : scene.boundary.at(t0);
  for (int node = 0; node < scene.nodes(); ++node) {
    const int dof = scene.first_dof[node];
    if (scene.role[node] == Role::driven)
      pull_back_knots(boundary, Vec3<T>(x_bar + dof), in_bar.of(Quantity::boundary),
                      static_cast<int>(scene.driven.size()), scene.driven_slot[node]);
    else
      Vec3<T>(x_bar + dof).add_to(in_bar.of(Quantity::position) + dof);
    Vec3<T>(v_bar + dof).add_to(in_bar.of(Quantity::velocity) + dof);
  }
}

// Reverses the rollout that `tape` recorded. seed(step, x_bar) adds the loss's cotangent of x at `step` (0 .. steps) to x_bar and shows it to `growth`;
// inputs_bar (layout.total()) receives, added, the gradient with respect to every input. Returns how many substeps were advanced again. Cost: one forward substep
// and its reverse per substep, and a forward substep for each that the tape's schedule advances again. Throws Diverged where cotangents grow
// beyond meaning.
template <class T, class List = Substep, class Seed>
long rollout_vjp(const Scene& scene, const Plan& plan, const T* inputs, double t0, Tape<T>& tape, Seed&& seed,
                 const CotangentGrowth<T>& growth, T* inputs_bar, Interrupt* interrupt = nullptr) {
  const auto turn = tape.turn(interrupt);
  const Inputs<const T> in{scene.layout, inputs};
  const Inputs<T> in_bar{scene.layout, inputs_bar};
  std::vector<T> v(scene.dofs()), v_before(plan.options.integrator == Integrator::bdf1 ? 0 : scene.dofs());
  // The state at a boundary, from the tape; BDF1 has no use for what was before.
  const auto state = [&](int n) -> SubstepStates<T> {
    const T* v0 = in.of(Quantity::velocity);
    tape.velocity(n, v0, v.data());
    if (n > 0) turn_velocities(scene, in.of(Quantity::mass), tape.x(n), v.data());
    if (v_before.empty()) return {tape.x(n), tape.x(n), v.data(), v.data(), n};
    tape.velocity(n - 1, v0, v_before.data());
    if (n > 1) turn_velocities(scene, in.of(Quantity::mass), tape.x(n - 1), v_before.data());
    return {tape.x(n), tape.x(n - 1), v.data(), v_before.data(), n};
  };
  std::optional<Rollout<T, List>> forward;
  if (tape.states() < tape.steps()) forward.emplace(scene, plan, inputs, t0);
  StateReverse<T, List> reverse(scene, plan);
  long recomputed = 0;
  const auto advance = [&](const Advance& a) {
    if (tape.holds(a.keep, a.to)) return;
    tape.forget_after(a.from);
    forward->restart(a.from, state(a.from));
    for (int n = a.from + 1; n <= a.to; ++n) {
      poll(interrupt, n, scene.dofs());
      forward->advance(tape.first_order(n - 1));
      if (n >= a.keep) tape.record(n, forward->x());
      ++recomputed;
    }
  };

  seed(tape.steps(), reverse.x_next_bar.data());
  if (tape.keeps_end()) reverse.end_at(tape.x(tape.steps()));
  Schedule schedule = tape.schedule();
  while (const auto action = schedule.next()) {
    if (const auto* a = std::get_if<Advance>(&*action)) {
      advance(*a);
      continue;
    }
    const int n = std::get<Reverse>(*action).step;
    poll(interrupt, n, scene.dofs());
    reverse.step(n, tape.first_order(n), in, t0 + (n + 1) * plan.options.h, state(n), seed, in_bar);
    if (n % growth.every == 0) growth.look(n, t0 + n * plan.options.h, scene, reverse.x_next_bar.data());
  }
  reverse.finish(in, in_bar);
  initial_state_vjp(scene, in, t0, reverse.x_next_bar.data(), reverse.v_next_bar.data(), in_bar);
  if (forward) tape.count_recomputed(recomputed);
  return recomputed;
}

}  // namespace sheetbend
