// What a gradient will cost: how many states its tape keeps under a budget, the bytes it works on, and the substeps it computes again.
#pragma once

#include <limits>
#include <stdexcept>

#include "adjoint/footprint.h"
#include "adjoint/tape.h"
#include "core/scalar/pack.h"

namespace sheetbend {

template <class T>
inline constexpr std::size_t lanes_of = std::is_same_v<T, Pack> ? Pack::lanes : 1;

inline constexpr std::size_t no_budget = std::numeric_limits<std::size_t>::max();

// The budget does not hold the least that a gradient needs.
struct BudgetTooSmall : std::runtime_error {
  std::size_t needed;
  explicit BudgetTooSmall(std::size_t needed_)
      : std::runtime_error("memory: the gradient needs at least " + std::to_string(needed_) + " bytes"),
        needed(needed_) {}
};

struct TapePlan {
  int steps = 0, states = 0, lanes = 1, at_once = 1;  // `at_once` tapes of `lanes` scenes each stand side by side
  std::size_t inputs = 0, frames = 0, plan = 0, forward = 0, reverse = 0, heap = 0, tape = 0;  // bytes, of all of them
  std::size_t least = 0;  // the smallest budget that works
  long recomputed = 0;    // substeps, of one tape

  std::size_t working() const { return inputs + frames + plan + forward + reverse + heap; }
};

// `scenes` rollouts with `frames` states each, of a scalar T; a vector of scenes is one scalar. What the caller holds of all of them is counted:
// inputs, gradient, states and their cotangents, with the tangents that T has.
template <class T>
TapePlan plan_tape(const Scene& scene, const Plan& plan, int steps, std::size_t frames, std::size_t scenes,
                   std::size_t budget) {
  TapePlan p;
  p.steps = steps;
  const std::size_t dofs = scene.dofs(), total = scene.layout.total();
  const std::size_t number = sizeof(T) / lanes_of<T>;
  p.inputs = 2 * number * scenes * total;
  p.frames = 2 * number * scenes * frames * dofs;
  if constexpr (!std::is_same_v<T, double>) {
    p.lanes = static_cast<int>(lanes_of<T>);
    const std::size_t packs = (scenes + lanes_of<T> - 1) / lanes_of<T>;
    p.at_once = static_cast<int>(std::min<std::size_t>(packs, plan.options.threads));
    p.inputs += 2 * sizeof(T) * total * p.at_once;
    p.frames += 2 * sizeof(T) * frames * dofs * p.at_once;
  }
  p.plan = plan_bytes(plan);
  p.forward = p.at_once * rollout_bytes<T>(scene, plan);
  p.reverse = p.at_once * reverse_bytes<T>(scene, plan);
  p.heap = p.working() / 50;  // holes that the allocator leaves
  const int window = Tape<T>::window(plan), least = Schedule::least(steps, window);
  const std::size_t state = p.at_once * sizeof(T) * dofs;
  const int ends = Tape<T>::ends(plan);
  p.least = p.working() + (least + ends) * state;
  if (budget < p.least) throw BudgetTooSmall(p.least);
  p.states = static_cast<int>(std::min<std::size_t>(std::max(1, steps), (budget - p.working()) / state - ends));
  p.tape = (p.states + ends) * state;
  p.recomputed = recomputed_steps(steps, p.states, window);
  return p;
}

}  // namespace sheetbend
