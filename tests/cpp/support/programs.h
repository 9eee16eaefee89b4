// The program that tests differentiate: a rollout with a loss over all its states, in any of the compiled
// scalars.
#pragma once

#include <limits>
#include <numeric>

#include "adjoint/rollout/rollout.h"
#include "tests/cpp/support/random_scene.h"

namespace sheetbend::testing {

struct Program {
  const Scene& scene;
  Plan plan;
  int steps;
  double t0 = 0.0;
  int counted = std::numeric_limits<int>::max();  // dofs from there on are not in the loss
};

// Weight of x[dof]^2 at a step in the loss sum_step sum_dof weight x^2.
inline double weight(int step, int dof) { return std::remainder(0.618034 * (31 * step + 17 * dof) + 0.1, 1.0); }

inline std::vector<int> every_step(const Program& p) {
  std::vector<int> steps(p.steps + 1);
  std::iota(steps.begin(), steps.end(), 0);
  return steps;
}

// States (steps + 1, dofs) without a tape.
template <class T>
std::vector<T> states(const Program& p, const std::vector<T>& inputs) {
  std::vector<T> all((p.steps + 1) * p.scene.dofs());
  rollout_states<T>(p.scene, p.plan, inputs.data(), p.t0, every_step(p), all.data(), nullptr);
  return all;
}

// The same, and the tape.
template <class T>
struct Recorded {
  std::vector<T> states;
  Tape<T> tape;
};
template <class T>
Recorded<T> record(const Program& p, const std::vector<T>& inputs, int kept = every_state) {
  std::vector<T> all((p.steps + 1) * p.scene.dofs());
  Tape<T> tape = record_rollout<T>(p.scene, p.plan, inputs.data(), p.t0, every_step(p), all.data(), kept, nullptr);
  return {std::move(all), std::move(tape)};
}

template <class T>
T loss(const Program& p, const std::vector<T>& inputs) {
  const std::vector<T> all = states(p, inputs);
  T sum(0.0);
  for (int step = 0, at = 0; step <= p.steps; ++step)
    for (int i = 0; i < p.scene.dofs(); ++i, ++at)
      if (i < p.counted) sum += T(weight(step, i)) * all[at] * all[at];
  return sum;
}

// The loss's gradient with respect to all inputs, by reverse.
template <class T>
std::vector<T> gradient(const Program& p, const std::vector<T>& inputs, Recorded<T>& recorded) {
  std::vector<T> x_bar, inputs_bar(inputs.size());
  for (int step = 0, at = 0; step <= p.steps; ++step)
    for (int i = 0; i < p.scene.dofs(); ++i, ++at)
      x_bar.push_back(i < p.counted ? T(2.0 * weight(step, i)) * recorded.states[at] : T(0.0));
  reverse_rollout<T>(p.scene, p.plan, inputs.data(), p.t0, recorded.tape, every_step(p), x_bar.data(),
                     inputs_bar.data(), nullptr);
  return inputs_bar;
}
template <class T>
std::vector<T> gradient(const Program& p, const std::vector<T>& inputs) {
  Recorded<T> recorded = record(p, inputs);
  return gradient(p, inputs, recorded);
}

// The ways to solve that a rollout's tests go through.
struct Solver {
  const char* name;
  Integrator integrator;
  Partition partition;
  bool net;  // one block with branches and loops, instead of ropes
  SceneShape shape(int ropes = 5) const {
    const bool sweeps = partition == Partition::gauss_seidel;
    return {.ropes = ropes,
            .net = net,
            .unilateral = sweeps,
            .volumes = sweeps || (net && partition != Partition::implicit),
            .directors = partition != Partition::implicit};
  }
  SolverOptions options(int iterations) const {
    // What is solved to the end takes as many iterations as it needs; in long substeps it would follow angles that no membrane holds
    // until their triangles collapse.
    const bool implicit = partition == Partition::implicit;
    return {.h = implicit ? 2.5e-4 : 4e-3,
            .integrator = integrator,
            .partition = partition,
            .iterations = implicit ? 100 : iterations};
  }
};
inline void PrintTo(const Solver& s, std::ostream* out) { *out << s.name; }

inline const auto all_solvers =
    ::testing::Values(Solver{"Bdf1GaussSeidel", Integrator::bdf1, Partition::gauss_seidel, false},
                      Solver{"Bdf2GaussSeidel", Integrator::bdf2, Partition::gauss_seidel, true},
                      Solver{"Bdf1Direct", Integrator::bdf1, Partition::direct, false},
                      Solver{"Bdf2Direct", Integrator::bdf2, Partition::direct, false},
                      Solver{"Bdf2DirectNet", Integrator::bdf2, Partition::direct, true},
                      Solver{"Bdf2Newton", Integrator::bdf2, Partition::newton, true});

// The same as Newton factored, and slow over complex numbers: for tests that need no gradient by complex step.
inline const Solver newton_by_cg{"Bdf2NewtonCg", Integrator::bdf2, Partition::newton_cg, true};

// Likewise slow; tests over directions and of one substep hold its derivatives.
inline const Solver implicit_bdf2{"Bdf2Implicit", Integrator::bdf2, Partition::implicit, true};

inline std::string solver_name(const ::testing::TestParamInfo<Solver>& info) { return info.param.name; }

}  // namespace sheetbend::testing
