// Ropes and cloths that touch themselves and each other: momentum, gradients against complex steps, equal bits, and that nothing passes through.
#include "core/rollout/rollout.h"
#include "tests/cpp/support/lanes.h"
#include "tests/cpp/support/self_contact_scenes.h"

namespace sheetbend::testing {
namespace {

constexpr double g = 9.81;

// A rope whose end is held falls on another one that is held at both, slides down from it and turns against a third one.
Sample falling_ropes() {
  TouchingBuilder b;
  b.rope(line({-0.07, 0.003, 0.0}, {0.045, 0.0, 0.001}, 4), 0.003, {0.0, 0.0, 0.0}, 0.006);
  b.rope(line({0.004, -0.11, 0.021}, {0.006, 0.052, 0.003}, 4), 0.002, {0.3, 0.1, -1.6}, 0.005);
  b.rope(line({0.05, -0.03, -0.03}, {0.0, 0.03, 0.025}, 3), 0.004, {-0.9, 0.0, 0.4}, 0.004);
  b.spec.pinned = {0, 3};
  return b.build(g);
}

// A small sheet falls on a larger one, whose corners are held, and slides off.
Sample falling_sheet() {
  TouchingBuilder b;
  const double e = 0.04;
  b.sheet(
      2, 2, [&](int i, int j) { return Vec3<double>(e * i, e * j, 0.002 * i * j); }, 0.002, {0.0, 0.0, 0.0}, 0.003,
      400.0);
  b.sheet(
      1, 2, [&](int i, int j) { return Vec3<double>(0.017 + 0.9 * e * i, 0.013 + 0.8 * e * j, 0.012 + 0.004 * i); },
      0.001, {0.2, -0.3, -1.5}, 0.002, 300.0);
  b.rope(line({-0.02, 0.03, 0.03}, {0.045, 0.009, 0.0}, 3), 0.001, {0.0, 0.1, -1.0}, 0.002);
  b.spec.pinned = {0, 2, 6};
  return b.build(g);
}

// Pairs that touch at the end of a substep of a rollout.
std::vector<PairKey> touching(const Rollout<double>& rollout, const Scene& scene, const std::vector<double>& inputs) {
  std::vector<double> radius(scene.nodes(), 0.0), reach(scene.nodes(), 0.0);
  for (int n = 0; n < scene.nodes(); ++n)
    if (scene.self_contact.radius[n] >= 0)
      radius[n] = inputs[scene.layout.of(Quantity::contact_radius) + scene.self_contact.radius[n]];
  return find_pairs(scene.self_contact, {rollout.x(), 3, radius.data(), reach.data()});
}

struct Case {
  Sample (*make)();
  Integrator integrator;
  int steps;
};

class Touching : public ::testing::TestWithParam<Case> {
 protected:
  const Sample s = GetParam().make();
  const Program p{s.scene, make_plan(s.scene, contact_options(1e-3, GetParam().integrator)), GetParam().steps};
};

TEST_P(Touching, BeginsAndEnds) {
  Rollout<double> rollout(s.scene, p.plan, s.inputs.data());
  int began = 0, ended = 0, points = 0;
  std::vector<PairKey> before;
  std::size_t matrices = 0;
  for (int n = 0; n < p.steps; ++n) {
    rollout.advance();
    matrices += rollout.balance()[0].size();
    const auto now = touching(rollout, s.scene, s.inputs);
    for (const PairKey& key : now) began += !std::ranges::binary_search(before, key);
    for (const PairKey& key : before) ended += !std::ranges::binary_search(now, key);
    for (const PairKey& key : now) points += key.triangle;
    before = now;
  }
  EXPECT_GT(began, 5);
  EXPECT_GT(ended, 4);
  EXPECT_GE(points, s.scene.self_contact.triangles.empty() ? 0 : 5);
  EXPECT_LE(static_cast<double>(matrices) / p.steps, 8.0);
}

TEST_P(Touching, HasTheGradientOfComplexSteps) {
  const auto of = [&](const std::vector<Complex>& probe) { return loss(p, probe); };
  expect_some_entries_agree(s.scene.layout, of, s.inputs, gradient(p, s.inputs), 1e-8);
}

// Complex steps go through the same matrix, so differences tell.
TEST_P(Touching, HasTheGradientOfDifferences) {
  const auto found = gradient(p, s.inputs);
  for (const std::size_t i :
       {s.scene.layout.of(Quantity::contact_radius), s.scene.layout.of(Quantity::contact_radius) + 1,
        s.scene.layout.of(Quantity::mass) + 4, s.scene.layout.of(Quantity::velocity) + 14}) {
    double ends[2];
    const double away = 1e-6 * std::max(1e-2, std::abs(s.inputs[i]));  // less is within the rounding of balances
    for (const int side : {0, 1}) {
      std::vector<double> moved = s.inputs;
      moved[i] += side ? away : -away;
      ends[side] = loss(p, moved);
    }
    EXPECT_NEAR(found[i], (ends[1] - ends[0]) / (2.0 * away), 2e-4 * std::abs(found[i])) << i;
  }
}

TEST_P(Touching, HasTheTangentsOfComplexSteps) {
  using D = Dual<double, 4>;
  const Layout& layout = s.scene.layout;
  std::vector<D> inputs(s.inputs.begin(), s.inputs.end());
  const std::size_t along[] = {layout.of(Quantity::contact_radius), layout.of(Quantity::contact_radius) + 1,
                               layout.of(Quantity::mass) + 5, layout.of(Quantity::velocity) + 13};
  for (int d = 0; d < 4; ++d) inputs[along[d]].d[d] = 1.0;
  Rollout<D> rollout(s.scene, p.plan, inputs.data());
  for (int n = 0; n < p.steps; ++n) rollout.advance();
  for (int d = 0; d < 4; ++d) {
    std::vector<Complex> probe(s.inputs.begin(), s.inputs.end());
    probe[along[d]].im = complex_step;
    const auto all = states(p, probe);
    std::vector<double> found, expected;
    for (int i = 0; i < s.scene.dofs(); ++i) {
      expected.push_back(all[p.steps * s.scene.dofs() + i].im / complex_step);
      found.push_back(rollout.x()[i].d[d]);
    }
    EXPECT_LE(relative_error(found, expected), 1e-8) << d;
  }
}

TEST_P(Touching, HasTheSameBitsWhateverKeepsItsStates) {
  expect_bits_of_any_tape(p, s.inputs);
  const Layout& layout = s.scene.layout;
  InputsOfLanes inputs(Pack::lanes, s.inputs);
  inputs[3][layout.of(Quantity::gravity) + 2] = -9.5;
  inputs[3][layout.of(Quantity::velocity) + 14] = -0.7;
  for (const int kept : {every_state, Schedule::least(p.steps, Tape<double>::window(p.plan)) + 2})
    expect_bits_of_lanes(p, inputs, {3, 5}, kept);
}

INSTANTIATE_TEST_SUITE_P(SelfContact, Touching,
                         ::testing::Values(Case{falling_ropes, Integrator::bdf1, 60},
                                           Case{falling_ropes, Integrator::bdf2, 60},
                                           Case{falling_sheet, Integrator::bdf1, 40},
                                           Case{falling_sheet, Integrator::bdf2, 40}));

// A rope flies at one that is held, by up to ten times the distance at which they touch in a substep.
TEST(SelfContact, LetsNothingPassHoweverFast) {
  for (const double speed : {2.0, 20.0, 100.0}) {
    TouchingBuilder b;
    b.rope(line({-0.06, 0.002, 0.0}, {0.03, 0.0, 0.0}, 5), 0.003, {0.0, 0.0, 0.0}, 0.005, 2000.0);
    b.rope(line({0.004, -0.06, 0.03 + 0.0023 * speed}, {0.0, 0.03, 0.0}, 5), 0.002, {0.0, 0.0, -speed}, 0.005, 2000.0);
    b.spec.pinned = {0, 4};
    const Sample s = b.build(0.0);
    const Plan plan = make_plan(s.scene, contact_options(1e-3));
    Rollout<double> rollout(s.scene, plan, s.inputs.data());
    bool touched = false;
    double nearest = 1.0;
    const int steps = static_cast<int>(3 + 40.0 / speed) + 15;
    for (int n = 0; n < steps; ++n) {
      rollout.advance();
      touched = touched || !touching(rollout, s.scene, s.inputs).empty();
      nearest = std::min(nearest, rollout.x()[3 * 7 + 2] - rollout.x()[3 * 2 + 2]);  // of their middles, upwards
    }
    EXPECT_TRUE(touched) << speed;
    EXPECT_GT(nearest, 0.01 - 1.1e-6 * speed) << speed;
  }
}

TEST(SelfContact, RefusesWhatIsDrivenThroughSomething) {
  TouchingBuilder b;
  b.rope(line({-0.03, -0.02, 0.0}, {0.03, 0.0, 0.0}, 3), 0.003, {0.0, 0.0, 0.0}, 0.005);
  b.rope(line({-0.01, -0.03, 0.02}, {0.0, 0.03, 0.0}, 3), 0.003, {0.0, 0.0, 0.0}, 0.005);
  b.spec.pinned = {0, 2};
  b.spec.driven = {3};
  b.spec.boundary = {{0.0, 0.001}, Interpolation::linear};
  Sample s = b.build(0.0);
  const Inputs<double> in{s.scene.layout, s.inputs.data()};
  for (int k = 0; k < 2; ++k) Vec3<double>(-0.01, -0.03, k ? -0.2 : 0.02).store(in.of(Quantity::boundary) + 3 * k);
  const Plan plan = make_plan(s.scene, contact_options(1e-3));
  Rollout<double> rollout(s.scene, plan, s.inputs.data());
  try {
    for (int n = 0; n < 10; ++n) rollout.advance();
    FAIL() << "nothing was refused";
  } catch (const Unbalanced& e) {
    EXPECT_NE(std::string(e.what()).find("driven through each other"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("smaller substep"), std::string::npos);
  }
}

TEST(SelfContact, IsRefusedWhereItIsNotMade) {
  const Sample s = falling_ropes();
  for (const Partition other : {Partition::gauss_seidel, Partition::direct, Partition::newton, Partition::newton_cg}) {
    SolverOptions options = contact_options(1e-3);
    options.partition = other;
    EXPECT_THROW(make_plan(s.scene, options), std::invalid_argument);
  }
}

}  // namespace
}  // namespace sheetbend::testing
