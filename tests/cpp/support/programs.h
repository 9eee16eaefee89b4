// The program that tests differentiate: a rollout with a loss over all its states, in any of the compiled
// scalars.
#pragma once

#include "adjoint/rollout.h"
#include "tests/cpp/support/random_scene.h"

namespace sheetbend::testing {

struct Program {
  const Scene& scene;
  Plan plan;
  int steps;
  double t0 = 0.0;
};

// Weight of x[dof]^2 at a step in the loss sum_step sum_dof weight x^2.
inline double weight(int step, int dof) { return std::remainder(0.618034 * (31 * step + 17 * dof) + 0.1, 1.0); }

template <class T>
Tape<T> record(const Program& p, const std::vector<T>& inputs) {
  return record_rollout<T>(p.scene, p.plan, inputs.data(), p.t0, p.steps, nullptr);
}

template <class T>
T loss(const Program& p, const std::vector<T>& inputs) {
  const Tape<T> tape = record(p, inputs);
  T sum(0.0);
  for (int step = 0; step <= p.steps; ++step)
    for (int i = 0; i < p.scene.dofs(); ++i) sum += T(weight(step, i)) * tape.x(step)[i] * tape.x(step)[i];
  return sum;
}

// The loss's gradient by all inputs, by tape and reverse.
template <class T>
std::vector<T> gradient(const Program& p, const std::vector<T>& inputs) {
  const Tape<T> tape = record(p, inputs);
  std::vector<int> wanted;
  std::vector<T> x_bar, inputs_bar(inputs.size());
  for (int step = 0; step <= p.steps; ++step) {
    wanted.push_back(step);
    for (int i = 0; i < p.scene.dofs(); ++i) x_bar.push_back(T(2.0 * weight(step, i)) * tape.x(step)[i]);
  }
  reverse_rollout<T>(p.scene, p.plan, inputs.data(), p.t0, tape, wanted, x_bar.data(), inputs_bar.data(), nullptr);
  return inputs_bar;
}

// The tape's states (steps + 1, dofs).
template <class T>
std::vector<T> states(const Tape<T>& tape, int dofs) {
  return {tape.x(0), tape.x(tape.steps()) + dofs};
}

// The ways to solve that a rollout's tests go through.
struct Solver {
  const char* name;
  Integrator integrator;
  Partition partition;
  bool net;  // one block with branches and loops, instead of ropes
  SolverOptions options(int iterations) const {
    return {.h = 4e-3, .integrator = integrator, .partition = partition, .iterations = iterations};
  }
};
inline void PrintTo(const Solver& s, std::ostream* out) { *out << s.name; }

inline const auto all_solvers =
    ::testing::Values(Solver{"Bdf1GaussSeidel", Integrator::bdf1, Partition::gauss_seidel, false},
                      Solver{"Bdf2GaussSeidel", Integrator::bdf2, Partition::gauss_seidel, true},
                      Solver{"Bdf1Direct", Integrator::bdf1, Partition::direct, false},
                      Solver{"Bdf2Direct", Integrator::bdf2, Partition::direct, false},
                      Solver{"Bdf2DirectNet", Integrator::bdf2, Partition::direct, true});

inline std::string solver_name(const ::testing::TestParamInfo<Solver>& info) { return info.param.name; }

}  // namespace sheetbend::testing
