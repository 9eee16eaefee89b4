// Rigid rows and kept volumes in the border of newton and newton_cg: the motion and the derivatives that direct has, which solves the same equations from
// the other side, and equal bits.
#include "core/rollout/redundant_rows.h"
#include "core/rollout/rollout.h"
#include "tests/cpp/support/lanes.h"

namespace sheetbend::testing {
namespace {

const Solver newton{"Newton", Integrator::bdf2, Partition::newton, true};

// A net with branches, loops and kept volumes; a few of its distances are rigid.
Sample rigid_net() {
  Sample s = random_scene(31, newton.shape());
  double* compliance = s.inputs.data() + s.scene.layout.of(Quantity::compliance);
  for (const Group& group : s.scene.groups)
    if (group.kind == kind_of("distance")) std::fill_n(compliance + group.first, std::min(group.count, 3), 0.0);
  return s;
}

struct RigidBorder : ::testing::TestWithParam<Solver> {
  Sample sample = rigid_net();
  Program program{sample.scene, make_plan(sample.scene, GetParam().options(2)), 2};
  Program direct{sample.scene,
                 make_plan(sample.scene, Solver{"", Integrator::bdf2, Partition::direct, true}.options(2)), 2};
};
INSTANTIATE_TEST_SUITE_P(, RigidBorder, ::testing::Values(newton, newton_by_cg), solver_name);

TEST_P(RigidBorder, MovesAsTheDirectBlock) {
  ASSERT_FALSE(program.plan.blocks.at(0).volumes.empty());
  const auto found = states(program, sample.inputs), expected = states(direct, sample.inputs);
  EXPECT_LE(relative_error(found, expected), 1e-10);
  Rollout<double> rollout(sample.scene, program.plan, sample.inputs.data()),
      other(sample.scene, direct.plan, sample.inputs.data());
  for (int n = 0; n < program.steps; ++n) rollout.advance(), other.advance();
  const int rows = sample.scene.multipliers();
  EXPECT_LE(relative_error(std::vector<double>(rollout.multipliers(), rollout.multipliers() + rows),
                           std::vector<double>(other.multipliers(), other.multipliers() + rows)),
            1e-8);
}

TEST_P(RigidBorder, HasItsDerivatives) {
  const auto found = gradient(program, sample.inputs), expected = gradient(direct, sample.inputs);
  const Layout& layout = sample.scene.layout;
  for (int q = 0; q < quantity_count; ++q) {
    if (layout.size[q] == 0) continue;
    const auto part = [&](const std::vector<double>& all) {
      return std::vector<double>(all.begin() + layout.offset[q], all.begin() + layout.offset[q] + layout.size[q]);
    };
    EXPECT_LE(relative_error(part(found), part(expected)), 1e-8) << quantity_names[q];
  }
  using D = Dual<double, 8>;
  std::vector<D> inputs(sample.inputs.begin(), sample.inputs.end());
  Random random(5);
  for (D& a : inputs)
    for (double& d : a.d) d = 1e-3 * random(-1.0, 1.0);
  const auto moved = states(program, inputs), by_direct = states(direct, inputs);
  std::vector<double> own, other;
  for (std::size_t i = 0; i < moved.size(); ++i)
    for (int d = 0; d < D::directions; ++d) own.push_back(moved[i].d[d]), other.push_back(by_direct[i].d[d]);
  EXPECT_LE(relative_error(own, other), 1e-8);
}

TEST_P(RigidBorder, HasTheBitsOfItsLanes) {
  expect_bits_of_any_tape(program, sample.inputs);
  InputsOfLanes inputs(Pack::lanes, sample.inputs);
  inputs[3][sample.scene.layout.of(Quantity::gravity) + 2] = -9.5;
  expect_bits_of_lanes(program, inputs, {3, 5});
}

}  // namespace
}  // namespace sheetbend::testing
