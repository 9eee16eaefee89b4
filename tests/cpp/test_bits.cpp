// The same bits: with and without tape, in every number of threads, in every lane, run after run.
#include "tests/cpp/support/lanes.h"

namespace sheetbend::testing {
namespace {

constexpr int steps = 12;

struct Bits : ::testing::TestWithParam<Solver> {
  Program program(const Scene& scene, int threads = 1) const {
    SolverOptions options = GetParam().options(2);
    options.threads = threads;
    options.grain = 1;
    options.cg_tolerance = 1e-4;  // to be fast
    return {scene, make_plan(scene, options), steps, 0.004};
  }
};
INSTANTIATE_TEST_SUITE_P(, Bits, all_solvers, solver_name);
INSTANTIATE_TEST_SUITE_P(Implicit, Bits, ::testing::Values(implicit_bdf2), solver_name);
INSTANTIATE_TEST_SUITE_P(Cg, Bits, ::testing::Values(newton_by_cg), solver_name);

// Each substep again from the tape's states, as the reverse does.
std::vector<double> recomputed(const Program& p, const Tape<double>& tape, const std::vector<double>& inputs) {
  const Inputs<const double> in{p.scene.layout, inputs.data()};
  const std::size_t dofs = p.scene.dofs();
  std::vector<double> all(tape.x(0), tape.x(0) + dofs), q(dofs), v(dofs), v_before(dofs), v_out(dofs);
  SubstepRecord<double> kept;
  kept.resize(p.scene, p.plan, true);
  for (int n = 0; n < p.steps; ++n) {
    tape.velocity(n, in.of(Quantity::velocity), v.data());
    tape.velocity(n - 1, in.of(Quantity::velocity), v_before.data());
    const Step<double> step{p.scene,
                            p.plan,
                            in,
                            Bdf::at(p.plan.options, n),
                            p.t0 + (n + 1) * p.plan.options.h,
                            {tape.x(n), tape.x(n - 1), v.data(), v_before.data()}};
    substep(step, q.data(), v_out.data(), kept);
    all.insert(all.end(), q.begin(), q.end());
  }
  return all;
}

TEST_P(Bits, AreEqualWithAndWithoutTape) {
  const Sample sample = random_scene(70, GetParam().shape());
  const Program p = program(sample.scene);
  const auto recorded = record(p, sample.inputs);
  EXPECT_TRUE(same_bits(recorded.states, states(p, sample.inputs)));
  EXPECT_TRUE(same_bits(recorded.states, recomputed(p, recorded.tape, sample.inputs)));
}

TEST_P(Bits, AreEqualRunAfterRun) {
  const Sample sample = random_scene(71, GetParam().shape()), again = random_scene(71, GetParam().shape());
  EXPECT_TRUE(same_bits(sample.inputs, again.inputs));
  const auto first = gradient(program(sample.scene), sample.inputs);
  EXPECT_TRUE(same_bits(first, gradient(program(again.scene), again.inputs)));
}

TEST_P(Bits, AreEqualForEveryNumberOfThreads) {
  const Sample sample = random_scene(72, GetParam().shape());
  const Program one = program(sample.scene);
  const auto forward = states(one, sample.inputs);
  const auto reverse = gradient(one, sample.inputs);
  for (const int threads : {2, 3, 8}) {
    const Program many = program(sample.scene, threads);
    for (int repetition = 0; repetition < 2; ++repetition) {
      EXPECT_TRUE(same_bits(states(many, sample.inputs), forward)) << threads << " threads";
      EXPECT_TRUE(same_bits(gradient(many, sample.inputs), reverse)) << threads << " threads";
    }
  }
}

// Eight scenes of one topology in the lanes against eight scalar runs.
TEST_P(Bits, AreEqualInEveryLane) {
  const Sample sample = random_scene(73, GetParam().shape());
  const Program p = program(sample.scene);
  expect_bits_of_lanes(p, scattered(sample.inputs, 73), every_lane);
}

}  // namespace
}  // namespace sheetbend::testing
