// Ropes and cloths that touch themselves and each other: momentum, gradients against complex steps, equal bits, and that nothing passes through.
#include "core/rollout/rollout.h"
#include "tests/cpp/support/lanes.h"
#include "tests/cpp/support/self_contact_scenes.h"

namespace sheetbend::testing {
namespace {

constexpr double g = 9.81;

// A rope whose end is held falls on another one that is held at both, slides down from it and turns against a third one.
Sample falling_ropes(double mu) {
  TouchingBuilder b;
  b.rope(line({-0.07, 0.003, 0.0}, {0.045, 0.0, 0.001}, 4), 0.003, {0.0, 0.0, 0.0}, 0.006);
  b.rope(line({0.004, -0.11, 0.021}, {0.006, 0.052, 0.003}, 4), 0.002, {0.3, 0.1, -1.6}, 0.005);
  b.rope(line({0.05, -0.03, -0.03}, {0.0, 0.03, 0.025}, 3), 0.004, {-0.9, 0.0, 0.4}, 0.004);
  b.spec.pinned = {0, 3};
  if (mu > 0.0) b.rub(mu, 12);
  return b.build(g);
}

// A small sheet falls on a larger one, whose corners are held, and slides off.
Sample falling_sheet(double mu) {
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
  if (mu > 0.0) b.rub(mu, 30);
  return b.build(g);
}

using Touching = TouchingTest;

TEST_P(Touching, BeginsAndEnds) {
  int points = 0, slid = 0, stuck = 0;
  const Course course = run([&](const Rollout<double>& rollout, const std::vector<PairKey>& now) {
    for (const PairKey& key : now) points += key.triangle;
    for (const auto& [code, force] : s.scene.self_contact.carried)
      if (const double kind = rollout.x()[3 * code]; is_coded(kind)) (slides_of(kind) ? slid : stuck) += 1;
  });
  const bool rubs = GetParam().friction > 0.0, cloth = !s.scene.self_contact.triangles.empty();
  EXPECT_GT(course.began, rubs && !cloth ? 4 : 5);  // ropes that rub stay on each other for longer
  EXPECT_GT(course.ended, 4);
  EXPECT_GT(slid, rubs ? 20 : -1);
  EXPECT_GT(stuck, rubs ? (cloth ? 5 : 0) : -1);
  EXPECT_GE(points, cloth ? 5 : 0);
  EXPECT_LE(static_cast<double>(course.matrices) / p.steps, rubs && cloth ? 12.0 : 8.0);
}

TEST_P(Touching, HasTheGradientOfComplexSteps) {
  const auto of = [&](const std::vector<Complex>& probe) { return loss(p, probe); };
  expect_sums_agree(s.scene.layout, of, s.inputs, gradient(p, s.inputs), 1e-8);
}

// Complex steps go through the same matrix, so differences tell. The error of these falls with the step until the rounding of balances shows, about 2e-14 of
// a loss of 3e-5; between their ends no pair begins, ends, sticks or slides in another substep.
TEST_P(Touching, HasTheGradientOfDifferences) {
  const auto found = gradient(p, s.inputs);
  const Layout& layout = s.scene.layout;
  std::vector<std::size_t> inputs{layout.of(Quantity::contact_radius), layout.of(Quantity::contact_radius) + 1,
                                  layout.of(Quantity::mass) + 4, layout.of(Quantity::velocity) + 14};
  if (GetParam().friction > 0.0) inputs.push_back(layout.of(Quantity::friction));
  for (const std::size_t i : inputs) {
    double ends[2];
    const bool speed = i >= layout.of(Quantity::velocity) && i < layout.of(Quantity::velocity) + s.scene.dofs();
    const double away = 1e-5 * (speed ? 1.0 : s.inputs[i]);
    for (const int side : {0, 1}) {
      std::vector<double> moved = s.inputs;
      moved[i] += side ? away : -away;
      ends[side] = loss(p, moved);
    }
    EXPECT_NEAR(found[i], (ends[1] - ends[0]) / (2.0 * away), 1e-4 * std::abs(found[i])) << i;
  }
}

TEST_P(Touching, HasTheTangentsOfComplexSteps) {
  const Layout& layout = s.scene.layout;
  const std::size_t last = GetParam().friction > 0.0 ? layout.of(Quantity::friction) : layout.of(Quantity::mass) + 5;
  expect_tangents_agree(p, s.inputs,
                        {layout.of(Quantity::contact_radius), layout.of(Quantity::contact_radius) + 1, last,
                         layout.of(Quantity::velocity) + 13},
                        1e-8);
}

TEST_P(Touching, HasTheSameBitsWhateverKeepsItsStates) {
  Program half = p;  // in which most pairs begin that do at all
  half.steps /= 2;
  expect_bits_of_any_tape(half, s.inputs);
  const Layout& layout = s.scene.layout;
  InputsOfLanes inputs(Pack::lanes, s.inputs);
  inputs[3][layout.of(Quantity::gravity) + 2] = -9.5;
  inputs[3][layout.of(Quantity::velocity) + 14] = -0.7;
  for (const int kept : {every_state, Schedule::least(half.steps, Tape<double>::window(half.plan)) + 2})
    expect_bits_of_lanes(half, inputs, {3, 5}, kept);
}

INSTANTIATE_TEST_SUITE_P(SelfContact, Touching,
                         ::testing::Values(TouchingCase{falling_ropes, Integrator::bdf2, 60},
                                           TouchingCase{falling_sheet, Integrator::bdf1, 40},
                                           TouchingCase{falling_ropes, Integrator::bdf1, 60, 0.2},
                                           TouchingCase{falling_ropes, Integrator::bdf2, 60, 0.2},
                                           TouchingCase{falling_sheet, Integrator::bdf2, 40, 0.3}));

// A short rope lies across one that is held, on a slope of 30 degrees (tan: 0.57735).
Sample on_a_slope(double mu) {
  const double D = 0.01, h = 1e-3, lean = 0.5 * std::sqrt(3.0);
  TouchingBuilder b;
  b.held_edge({-0.5, 0.0, 0.0}, {0.5, 0.0, 0.0}, 0.5 * D);
  b.rope(line({0.0, -0.05, D - g * h * h * lean / rigidity}, {0.0, 0.1, 0.0}, 2), 0.002, {0.0, 0.0, 0.0}, 0.5 * D);
  b.rub(mu, 2);
  Sample s = b.build(g);
  const Inputs<double> in{s.scene.layout, s.inputs.data()};
  Vec3<double>(0.5 * g, 0.0, -lean * g).store(in.of(Quantity::gravity));
  return s;
}

TEST(SelfContact, SticksBelowTheCriticalAngle) {
  const Sample s = on_a_slope(0.578);
  const Plan plan = make_plan(s.scene, contact_options(1e-3));
  Rollout<double> rollout(s.scene, plan, s.inputs.data());
  for (int n = 0; n < 500; ++n) rollout.advance();
  EXPECT_LT(std::abs(rollout.x()[6]), 1e-8);
}

// As a block does: x = (sin - mu cos) g t^2/2, BDF1 having t (t + h) in the place of t^2.
TEST(SelfContact, SlidesAsCoulombSays) {
  for (const double mu : {0.577, 0.3}) {
    const Sample s = on_a_slope(mu);
    const int steps = 200;
    const Program p{s.scene, make_plan(s.scene, contact_options(1e-3)), steps};
    const double cosine = 0.5 * std::sqrt(3.0), path = 0.5 * g * 1e-6 * steps * (steps + 1);
    std::vector<double> seed(s.scene.dofs());
    seed[6] = 1.0;
    const auto end = states(p, s.inputs);
    const double* last = &end[static_cast<std::size_t>(steps) * s.scene.dofs()];
    EXPECT_NEAR(last[6], (0.5 - mu * cosine) * path, 2e-5 * path) << mu;
    // At 0.577 it sticks in the first substep, before the force that it carries has grown, and one in two hundred is missing.
    const auto bar = gradient_of_end(p, s.inputs, seed);
    if (mu < 0.5) {
      EXPECT_NEAR(bar[s.scene.layout.of(Quantity::friction)], -cosine * path, 1e-3 * path);
    }
    // What the pair carries is Coulomb's limit, down the slope on the one that is held.
    const auto& place = s.scene.self_contact.carried[0];
    EXPECT_EQ(last[3 * place[0]], 3.0);  // two edges, sliding
    EXPECT_NEAR(last[3 * place[1]], mu * 0.004 * g * cosine, 1e-4 * 0.004 * g) << mu;
  }
}

// What a pair carries at the end of a substep, and what it may carry.
struct Carried {
  PairKey key;
  bool slides;
  Vec3<double> force, apart;  // on the first side; from the second side to the first
  double limit;
};

// Of edges whose particles are all free, in a substep of BDF1 of this length.
std::vector<Carried> carried(const Sample& s, const double* x, double h) {
  const Inputs<const double> in{s.scene.layout, s.inputs.data()};
  const SelfContact& own = s.scene.self_contact;
  std::vector<Carried> all;
  for (const auto& [code, force] : own.carried) {
    if (!is_coded(x[3 * code])) break;
    const PairKey key = decoded(x[3 * code], x[3 * code + 1], x[3 * code + 2]);
    const auto nodes = spots_of(own, key);
    double at[12], w[4];
    for (int d = 0; d < 12; ++d) at[d] = x[3 * nodes[d / 3] + d % 3];
    for (int k = 0; k < 4; ++k) w[k] = 1.0 / in.of(Quantity::mass)[nodes[k]];
    const auto radius = [&](int k) { return in.of(Quantity::contact_radius)[own.radius[nodes[k]]]; };
    const auto numbers = pair_numbers(key.triangle, radius(0), radius(3), w, rigidity / (h * h));
    const double softness = softness_of(numbers);
    const auto n = nearest_points(key.triangle, at, softness, nearest_part(key.triangle, at, softness));
    const double distance = std::sqrt(n.squared), push = numbers.kappa * (numbers.touching - distance);
    all.push_back({key, slides_of(x[3 * code]), Vec3<double>(x + 3 * force), n.apart,
                   in.of(Quantity::friction)[own.friction] * push * norm(n.apart) / distance});
  }
  return all;
}

// Two ropes in flight draw each other tight where they cross. Forces act on middle lines, so that friction turns both by its couple, and nothing else does.
TEST(SelfContact, KeepsMomentumAndTheConeAndTurnsByItsCouples) {
  TouchingBuilder b;
  b.rope(line({-0.06, 0.004, 0.0}, {0.03, 0.0, 0.002}, 5), 0.003, {0.0, 0.0, 0.0}, 0.005);
  b.rope(line({0.007, -0.05, 0.0103}, {0.004, 0.03, 0.0}, 5), 0.002, {0.5, 0.1, -0.5}, 0.005);
  const int particles = static_cast<int>(b.mass.size());
  for (const int end : {0, 4, 5, 9}) {
    b.velocity[3 * end + 2] = end < 5 ? 1.0 : -1.0;
    b.mass[end] *= 20.0;
  }
  b.rub(0.3, 4);
  const Sample s = b.build(0.0);
  const double h = 1e-3;
  const Plan plan = make_plan(s.scene, contact_options(h));
  Rollout<double> rollout(s.scene, plan, s.inputs.data());
  const double momentum = 0.2;  // of its parts
  const double* v = rollout.state().v;
  std::vector<double> before(v, v + 3 * particles);
  const auto total = [&](const double* v) {
    Vec3<double> sum(0.0, 0.0, 0.0);
    for (int n = 0; n < particles; ++n) sum = sum + b.mass[n] * Vec3<double>(v + 3 * n);
    return sum;
  };
  const Vec3<double> start = total(before.data());
  int slid = 0, stuck = 0;
  double most = 0.0;
  for (int n = 0; n < 40; ++n) {
    rollout.advance();
    v = rollout.state().v;
    EXPECT_LE(norm(total(v) - start), 1e-12 * momentum) << n;
    Vec3<double> turned(0.0, 0.0, 0.0), couple(0.0, 0.0, 0.0);
    for (int p = 0; p < particles; ++p) {
      const Vec3<double> change = Vec3<double>(v + 3 * p) - Vec3<double>(&before[3 * p]);
      turned = turned + b.mass[p] * cross(Vec3<double>(rollout.x() + 3 * p), change);
    }
    for (const Carried& c : carried(s, rollout.x(), h)) {
      couple = couple + h * cross(c.apart, c.force);
      EXPECT_LE(norm(c.force), (1.0 + 1e-9) * c.limit) << n;
      EXPECT_LE(std::abs(dot(c.force, c.apart)), 1e-10 * norm(c.force) * norm(c.apart)) << n;
      if (c.slides) {
        EXPECT_GE(norm(c.force), (1.0 - 1e-9) * c.limit) << n;
      }
      (c.slides ? slid : stuck) += 1;
    }
    most = std::max(most, norm(couple));
    EXPECT_LE(norm(turned - couple), 1e-12 * 0.1 * momentum) << n;
    before.assign(v, v + 3 * particles);
  }
  EXPECT_GT(slid, 2);
  EXPECT_GT(stuck, 2);
  EXPECT_GT(most, 1e-3 * 0.01 * momentum);
}

TEST(SelfContact, RefusesMorePairsThanItHasPlacesFor) {
  TouchingBuilder b;
  b.held_edge({-0.5, 0.0, 0.0}, {0.5, 0.0, 0.0}, 0.005);
  for (const double x : {-0.25, 0.25})
    b.rope(line({x, -0.05, 0.011}, {0.0, 0.1, 0.0}, 2), 0.002, {0.0, 0.0, -1.0}, 0.005);
  b.rub(0.3, 1);
  const Sample s = b.build(g);
  const Plan plan = make_plan(s.scene, contact_options(1e-3));
  Rollout<double> rollout(s.scene, plan, s.inputs.data());
  try {
    for (int n = 0; n < 5; ++n) rollout.advance();
    FAIL() << "nothing was refused";
  } catch (const Unbalanced& e) {
    EXPECT_NE(std::string(e.what()).find("more than 1 pairs"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("pairs="), std::string::npos);
  }
}

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
  const Sample s = falling_ropes(0.0);
  for (const Partition other : {Partition::gauss_seidel, Partition::direct, Partition::newton, Partition::newton_cg}) {
    SolverOptions options = contact_options(1e-3);
    options.partition = other;
    EXPECT_THROW(make_plan(s.scene, options), std::invalid_argument);
  }
}

}  // namespace
}  // namespace sheetbend::testing
