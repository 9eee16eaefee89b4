// Rollouts with eight directions: the values have the bits of a rollout without them, the directions are those of the complex step.
#include <limits>

#include "core/scalar/dual.h"
#include "tests/cpp/support/programs.h"

namespace sheetbend::testing {
namespace {

struct Tangents : ::testing::TestWithParam<Solver> {};
INSTANTIATE_TEST_SUITE_P(, Tangents, all_solvers, solver_name);
INSTANTIATE_TEST_SUITE_P(Implicit, Tangents, ::testing::Values(implicit_bdf2), solver_name);
INSTANTIATE_TEST_SUITE_P(Cg, Tangents, ::testing::Values(newton_by_cg), solver_name);

TEST_P(Tangents, FollowTheRollout) {
  using D = Dual<double, 8>;
  const Sample sample = random_scene(90, GetParam().shape());
  SolverOptions options = GetParam().options(2);
  const Program p{sample.scene, make_plan(sample.scene, options), 8, 0.004};
  // Conjugate gradients over complex numbers leave some 1e-12, factors do not.
  if (options.partition == Partition::newton_cg) options.partition = Partition::newton;
  const Program exact{sample.scene, make_plan(sample.scene, options), 8, 0.004};
  Random random(80);
  std::vector<D> inputs(sample.inputs.begin(), sample.inputs.end());
  for (D& a : inputs)
    for (double& d : a.d) d = random(-1.0, 1.0) * std::abs(a.v);
  const std::vector<D> found = states(p, inputs);
  const auto part = [](const std::vector<D>& all, int k) {
    std::vector<double> out;
    for (const D& a : all) out.push_back(k < 0 ? a.v : a.d[k]);
    return out;
  };
  EXPECT_TRUE(same_bits(part(found, -1), states(p, sample.inputs)));
  double worst = 0.0;
  for (int k = 0; k < 8; ++k) {
    const auto oracle = [&](const std::vector<double>& at) {
      return complex_step_along([&](const std::vector<Complex>& z) { return states(exact, z); }, at, part(inputs, k));
    };
    const std::vector<double> expected = oracle(sample.inputs);
    const double error = relative_error(part(found, k), expected);
    worst = std::max(worst, error);
    if (error <= 1e-12) continue;
    // No worse than what the last bits of the inputs do to the oracle itself: both programs round, each on its own. One change of these bits may
    // by chance do a tenth of what another does.
    double rounding = 0.0;
    for (int draw = 0; draw < 4; ++draw) {
      std::vector<double> near = sample.inputs;
      for (double& a : near) a *= 1.0 + random(-1.0, 1.0) * std::numeric_limits<double>::epsilon();
      rounding = std::max(rounding, relative_error(oracle(near), expected));
    }
    EXPECT_LE(error, 2.0 * rounding);
  }
  record_error("tangents", worst);
}

}  // namespace
}  // namespace sheetbend::testing
