// One substep as a function: from a state and the scene's inputs to the next state, and its reverse. Nothing is carried between calls, so states may come
// in any order and each substep may have inputs of its own. A state is (x, x_before, v, v_before), four times dofs() numbers, as a rollout has it at
// `step`.
#pragma once

#include <bit>
#include <cstring>
#include <optional>

#include "core/rollout/rollout.h"

namespace sheetbend {

template <class T>
class SingleStep {
 public:
  SingleStep(const Scene& scene, const Plan& plan) : scene_(scene), plan_(plan), inputs_(scene.layout.total()) {}

  // Writes the next state, with the bits that a rollout gives it, and counts `after_impact` on. Throws Diverged, Unbalanced or Unconverged.
  void forward(int step, const T* inputs, const T* state, AfterImpact<T>& after_impact, T* next) {
    take(inputs);
    rollout_->restart(step, states(step, state, after_impact));
    rollout_->advance();
    const SubstepStates<T> to = rollout_->state();
    after_impact = to.after_impact;
    for (const T* part : {to.x, to.x_before, to.v, to.v_before}) next = std::copy_n(part, scene_.dofs(), next);
  }

 private:
  SubstepStates<T> states(int step, const T* state, const AfterImpact<T>& after_impact) const {
    const std::size_t dofs = scene_.dofs();
    return {state, state + dofs, state + 2 * dofs, state + 3 * dofs, step, nullptr, after_impact};
  }

  // A rollout keeps what it has computed from masses and the like, so other ones ask for another rollout. Forces, gravity and motions are read anew in
  // each substep.
  void take(const T* inputs) {
    constexpr Quantity anew[] = {Quantity::boundary, Quantity::force,    Quantity::gravity,
                                 Quantity::wind,     Quantity::pressure, Quantity::load};
    bool same = rollout_.has_value();
    for (int q = 0; q < quantity_count && same; ++q) {
      const std::size_t first = scene_.layout.offset[q], size = scene_.layout.size[q];
      if (size == 0 || std::ranges::find(anew, static_cast<Quantity>(q)) != std::end(anew)) continue;
      same = std::memcmp(inputs + first, inputs_.data() + first, size * sizeof(T)) == 0;
    }
    std::copy_n(inputs, inputs_.size(), inputs_.data());
    if (!same) rollout_.emplace(scene_, plan_, inputs_.data());
  }

  const Scene& scene_;
  const Plan& plan_;
  std::vector<T> inputs_;
  std::optional<Rollout<T>> rollout_;
};

// The reverse of SingleStep::forward from `state` to `next`, which went with BDF1 in the scenes `first_order`: cotangents of the next state, used up, to
// those of the state and of the inputs (layout.total()), added. T: double, Pack.
template <class T>
void single_step_vjp(const Scene& scene, const Plan& plan, int step, Scenes first_order, const T* inputs,
                     const T* state, const T* next, T* next_bar, T* state_bar, T* inputs_bar);

}  // namespace sheetbend
