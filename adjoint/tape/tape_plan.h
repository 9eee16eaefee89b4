// What a gradient will cost: how many states its tape keeps under a budget, the bytes it works on, and the substeps it computes again.
#pragma once

#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>

#include "core/solver/plan.h"

namespace sheetbend {

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
// inputs, gradient, states and their cotangents, with the tangents that T has. T: double, Pack or Dual<double, 1>.
template <class T>
TapePlan plan_tape(const Scene& scene, const Plan& plan, int steps, std::size_t frames, std::size_t scenes,
                   std::size_t budget);

}  // namespace sheetbend
