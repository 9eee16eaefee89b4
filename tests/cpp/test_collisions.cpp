// Balls that hit each other: closed forms, what is conserved, the order of impacts in a substep, and gradients.
#include <set>

#include "core/rollout/rollout.h"
#include "tests/cpp/support/bounces.h"
#include "tests/cpp/support/lanes.h"

namespace sheetbend::testing {
namespace {

constexpr double g = 9.81;

class Colliding : public ::testing::TestWithParam<Integrator> {};
INSTANTIATE_TEST_SUITE_P(Collisions, Colliding, ::testing::Values(Integrator::bdf1, Integrator::bdf2));

// Two equal balls hit head on without loss: x2 = v0 T + x1 + 2 r.
TEST_P(Colliding, HandTheirSpeedOn) {
  ContactBuilder b;
  b.particle({0.0, 0.0, 0.0}, 0.3, {1.0, 0.0, 0.0}), b.particle({0.52, 0.0, 0.0}, 0.3);
  b.balls({0, 1}, {0.1, 0.1}, 1.0);
  const Sample s = b.build(0.0);
  const Program p = program(s, 1.0 / 480.0, 1.0, GetParam());
  const auto all = states(p, s.inputs);
  EXPECT_NEAR(all[p.steps * s.scene.dofs() + 3], 1.2, 1e-12);
  EXPECT_NEAR(all[p.steps * s.scene.dofs()], 0.32, 1e-12);
  const auto bar = gradient_of_end(p, s.inputs, {0.0, 0.0, 0.0, 1.0, 0.0, 0.0});
  const auto of = [&](Quantity q, int i) { return bar[s.scene.layout.of(q) + i]; };
  EXPECT_NEAR(of(Quantity::position, 0), 1.0, 1e-12);
  EXPECT_NEAR(of(Quantity::position, 3), 0.0, 1e-12);
  EXPECT_NEAR(of(Quantity::velocity, 0), 1.0, 1e-12);
  EXPECT_NEAR(of(Quantity::velocity, 3), 0.0, 1e-12);
  for (int ball : {0, 1}) EXPECT_NEAR(of(Quantity::contact_radius, ball), 1.0, 1e-12);
  // m1, m2: v2 = 2 m1/(m1 + m2) from the impact at 0.32 s on.
  EXPECT_NEAR(of(Quantity::mass, 0), 0.68 / (2.0 * 0.3), 1e-12);
  EXPECT_NEAR(of(Quantity::mass, 1), -0.68 / (2.0 * 0.3), 1e-12);
  EXPECT_NEAR(of(Quantity::restitution, 0), 0.68 / 2.0, 1e-12);
}

// As fast as several of their widths in a substep, they still meet.
TEST_P(Colliding, DoNotPassThroughEachOther) {
  ContactBuilder b;
  b.particle({0.0, 0.0, 0.0}, 1.0, {100.0, 0.0, 0.0}), b.particle({0.5, 0.0, 0.0}, 1.0);
  b.balls({0, 1}, {0.01, 0.01}, 1.0);
  const Sample s = b.build(0.0);
  const Program p = program(s, 0.01, 0.02, GetParam());
  const auto all = states(p, s.inputs);
  EXPECT_NEAR(all[p.steps * s.scene.dofs()], 0.48, 1e-12);
  EXPECT_NEAR(all[p.steps * s.scene.dofs() + 3], 2.02, 1e-12);
}

// A gas of unlike balls.
Sample gas_of_balls(double e, int count = 14) {
  ContactBuilder b;
  Random random(3);
  std::vector<int> nodes;
  std::vector<double> radii;
  for (int i = 0; i < count; ++i) {
    const double along = 0.2 * (i % 4), across = 0.2 * (i / 4 % 2), up = 0.2 * (i / 8);
    const Vec3<double> inward = -4.0 * Vec3<double>(along - 0.3, across - 0.1, up - 0.1);
    nodes.push_back(b.particle({along, across, up}, random(0.1, 1.0),
                               inward + Vec3<double>(random(-1.0, 1.0), random(-1.0, 1.0), random(-1.0, 1.0))));
    radii.push_back(random(0.03, 0.09));
  }
  b.balls(nodes, radii, e);
  return b.build(0.0);
}

TEST_P(Colliding, KeepMomentumAndEnergy) {
  for (const auto& [e, count] : {std::pair{1.0, 14}, {0.4, 14}, {0.0, 14}, {1.0, 64}}) {
    const Sample s = gas_of_balls(e, count);
    const Program p = program(s, 2e-3, 0.4, GetParam());
    const Inputs<const double> in{s.scene.layout, s.inputs.data()};
    const auto sums = [&](const double* v) {
      std::array<double, 4> sum{};
      for (int n = 0; n < s.scene.nodes(); ++n)
        for (int d = 0; d < 3; ++d) {
          sum[d] += in.of(Quantity::mass)[n] * v[3 * n + d];
          sum[3] += 0.5 * in.of(Quantity::mass)[n] * v[3 * n + d] * v[3 * n + d];
        }
      return sum;
    };
    Rollout<double> rollout(s.scene, p.plan, s.inputs.data());
    const auto before = sums(rollout.state().v);
    std::size_t impacts = 0;
    double overlap = 0.0;
    for (int n = 0; n < p.steps; ++n) {
      rollout.advance();
      impacts += rollout.impacts().size();
      for (int i = 0; i < s.scene.nodes(); ++i)
        for (int j = 0; j < i; ++j)
          overlap = std::max(overlap, in.of(Quantity::contact_radius)[i] + in.of(Quantity::contact_radius)[j] -
                                          norm(Vec3<double>(rollout.x() + 3 * i) - Vec3<double>(rollout.x() + 3 * j)));
    }
    EXPECT_GE(impacts, count == 14 ? 10u : 100u);
    EXPECT_LE(overlap, 1e-12);
    const auto after = sums(rollout.state().v);
    for (int d = 0; d < 3; ++d) EXPECT_NEAR(after[d], before[d], 1e-12);
    if (e == 1.0)
      EXPECT_NEAR(after[3], before[3], 1e-12 * before[3]);
    else
      EXPECT_LT(after[3], 0.99 * before[3]);
  }
}

// Five balls that touch, hit by a sixth: the impact goes through all of them in one substep, one after the other, and the last one leaves.
TEST_P(Colliding, PassAnImpactOnInOrder) {
  ContactBuilder b;
  b.particle({-0.1505, 0.0, 0.0}, 1.0, {1.0, 0.0, 0.0});
  for (const int place : {3, 0, 4, 1, 2})
    b.particle({0.1 * place, 0.0, 0.0}, 1.0);  // their numbers are not their order
  b.balls({0, 1, 2, 3, 4, 5}, std::vector<double>(6, 0.05), 1.0);
  const Sample s = b.build(0.0);
  const Program p = program(s, 0.1, 1.0, GetParam());
  Rollout<double> rollout(s.scene, p.plan, s.inputs.data());
  std::vector<int> order;
  for (int n = 0; n < p.steps; ++n) {
    rollout.advance();
    EXPECT_EQ(rollout.impacts().size(), n == 0 ? 5u : 0u);
    for (const auto& impact : rollout.impacts()) order.push_back(impact.flown()[0].node * 10 + impact.flown()[1].node);
  }
  EXPECT_EQ(order, (std::vector<int>{2, 24, 45, 15, 13}));
  for (int n = 0; n < 6; ++n) EXPECT_NEAR(rollout.state().v[3 * n], n == 3 ? 1.0 : 0.0, 1e-12) << n;
  EXPECT_NEAR(rollout.x()[3 * 3], 0.4 + 0.9495, 1e-12);
}

// Two pairs hit each other at the same instant, then their inner balls. Along a line equal balls hand on their speeds: the first one ends on the path of the third.
TEST_P(Colliding, MeetAfterImpactsAtTheSameInstant) {
  ContactBuilder b;
  for (const double side : {-1.0, 1.0})
    b.particle({0.4 * side, 0.0, 0.0}, 1.0, {-side, 0.0, 0.0}), b.particle({0.15 * side, 0.0, 0.0}, 1.0);
  b.balls({0, 1, 2, 3}, std::vector<double>(4, 0.05), 1.0);
  const Sample s = b.build(0.0);
  const Program p = program(s, 0.5, 1.0, GetParam());
  const auto all = states(p, s.inputs);
  EXPECT_NEAR(all[p.steps * s.scene.dofs()], 0.4 - 1.0 - 0.3, 1e-12);
  std::vector<double> seed(s.scene.dofs());
  seed[0] = 1.0;
  const auto bar = gradient_of_end(p, s.inputs, seed);
  for (int n = 0; n < 4; ++n) {
    EXPECT_NEAR(bar[s.scene.layout.of(Quantity::position) + 3 * n], n == 2 ? 1.0 : 0.0, 1e-12) << n;
    EXPECT_NEAR(bar[s.scene.layout.of(Quantity::velocity) + 3 * n], n == 2 ? 1.0 : 0.0, 1e-12) << n;
  }
}

// Three balls on a floor, one on the other: they stay, as deep in each other as one falls in a few substeps.
TEST_P(Colliding, RestOnEachOther) {
  for (const double e : {0.0, 0.3, 0.8}) {
    ContactBuilder b;
    for (const double height : {0.1, 0.3, 0.5}) b.particle({0.0, 0.0, height}, 0.3);
    b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
    b.contact(0.3, 0.1);
    b.balls({0, 1, 2}, {0.1, 0.1, 0.1}, e);
    constexpr double h = 2e-3;
    const Sample s = b.build(g);
    const Program p = program(s, h, 2.0, GetParam());
    const auto all = states(p, s.inputs);
    double deepest = 0.0, highest = 0.0;
    for (int n = 0; n <= p.steps; ++n)
      for (int ball = 0; ball < 3; ++ball) {
        const double raised = all[n * s.scene.dofs() + 3 * ball + 2] - (0.1 + 0.2 * ball);
        deepest = std::max(deepest, -raised), highest = std::max(highest, raised);
      }
    EXPECT_LE(deepest, 12.0 * g * h * h) << e;
    EXPECT_LE(highest, 12.0 * g * h * h) << e;
  }
}

// Four balls, three of which hit each other while they bounce off shapes, in few substeps and in many.
Sample juggled_balls() {
  ContactBuilder b;
  b.particle({0.0, 0.0, 0.05}, 0.3, {0.5, 0.2, -1.5});
  b.particle({0.04, 0.01, 0.08}, 0.2, {-0.6, -0.3, -2.0});
  b.particle({0.02, 0.03, 0.04}, 0.1, {-2.5, -0.4, -3.0});
  b.particle({-0.02, -0.02, 0.09}, 0.15, {1.5, 1.4, -1.0});
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.05, -0.1, 0.3});
  b.collider("rounded_box", {0.02, 0.08, 0.08, 0.01},
             {-0.07, 0.0, 0.03, 0.0, 0.1, 0.2, -0.06, 0.0, 0.04, 0.3, 0.2, 0.4}, {0.0, 0.08});
  b.contact(0.2, 0.003, 0.0, 0.7);
  b.balls({2, 0, 3, 1}, {0.011, 0.013, 0.012, 0.014}, 0.8);
  return b.build(g);
}

class JugglingBalls : public ::testing::TestWithParam<Juggle> {};
INSTANTIATE_TEST_SUITE_P(Collisions, JugglingBalls, juggles());

TEST_P(JugglingBalls, HaveTheGradientOfComplexSteps) {
  const Sample s = juggled_balls();
  const Program p = program(s, GetParam().h, 0.08, GetParam().integrator);
  Rollout<double> rollout(s.scene, p.plan, s.inputs.data());
  int together = 0, alone = 0;
  for (int n = 0; n < p.steps; ++n) {
    rollout.advance();
    for (const auto& impact : rollout.impacts()) ++(impact.contact < 0 ? together : alone);
  }
  EXPECT_GE(together, 2);
  EXPECT_GE(alone, 3);
  expect_gradient_of_complex_steps(p, s, 4);
}

TEST_P(JugglingBalls, HaveTheTangentsOfComplexSteps) {
  const Sample s = juggled_balls();
  const Program p = program(s, GetParam().h, 0.08, GetParam().integrator);
  const Layout& l = s.scene.layout;
  expect_tangents_agree(p, s.inputs,
                        {l.of(Quantity::contact_radius) + l.count(Quantity::contact_radius) - 1,
                         l.of(Quantity::restitution) + l.count(Quantity::restitution) - 1, l.of(Quantity::mass) + 1,
                         l.of(Quantity::velocity) + 4},
                        1e-9);
}

TEST_P(JugglingBalls, HaveTheSameBitsWhateverKeepsTheirStates) {
  const Sample s = juggled_balls();
  const Program p = program(s, GetParam().h, 0.08, GetParam().integrator);
  expect_bits_of_any_tape(p, s.inputs);
  InputsOfLanes inputs(Pack::lanes, s.inputs);
  inputs[3][s.scene.layout.of(Quantity::velocity) + 2] = -0.9;
  expect_bits_of_lanes(p, inputs, {3, 5}, Schedule::least(p.steps, Tape<double>::window(p.plan)));
}

// Two balls on rigid strings, one in a chain of springs, and a free one; the chain falls on a plane.
struct Strung {
  Sample (*scene)();
  Partition partition;
  Integrator integrator;
};
Sample strung_balls() {
  ContactBuilder b;
  b.particle({0.0, 0.0, 0.05}, 0.3, {0.9, 0.1, -0.5}), b.particle({0.05, 0.01, 0.05}, 0.2, {-0.6, -0.1, -0.4});
  b.particle({0.09, 0.01, 0.04}, 0.1, {-1.9, 0.1, -0.9}), b.particle({0.02, 0.04, 0.05}, 0.15, {0.4, -1.4, -0.3});
  b.particle({0.12, 0.01, 0.03}, 0.05, {-1.0, 0.0, -1.0});
  b.spec.pinned = {b.particle({0.0, 0.0, 0.15}, 1.0), b.particle({0.05, 0.0, 0.16}, 1.0)};
  b.constraint("distance", {0, 5}, 0.0, {0.1}), b.constraint("distance", {1, 6}, 0.0, {0.1105});
  b.constraint("distance", {2, 4}, 1e-3, {0.03});
  b.moving = 5;
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.05, -0.1, 0.3});
  b.contact(0.4, 0.013);
  b.balls({0, 1, 2, 3}, {0.011, 0.013, 0.012, 0.014}, 0.8);
  return b.build(g);
}

// A ball at the end of a bent row of rods, one of them stiff and damped, and two dumbbells that fly against it.
Sample balls_on_rods() {
  ContactBuilder b;
  const Vec3<double> a(-0.6, 0.2, -0.1), c(0.9, 0.1, -0.2), d(-1.2, 0.3, 0.1);
  b.particle({0.0, 0.0, 0.05}, 0.3, a), b.particle({0.03, 0.004, 0.05}, 0.2, a), b.particle({0.05, 0.02, 0.06}, 0.1, a);
  b.particle({-0.028, 0.003, 0.048}, 0.15, c), b.particle({-0.05, -0.01, 0.05}, 0.25, c);
  b.particle({0.09, 0.024, 0.063}, 0.1, d), b.particle({0.11, 0.02, 0.07}, 0.05, d);
  const auto rod = [&](int i, int k, double compliance) {
    b.constraint("distance", {i, k}, compliance, {norm(Vec3<double>(&b.x[3 * i]) - Vec3<double>(&b.x[3 * k]))});
  };
  rod(0, 1, 0.0), rod(1, 2, 1e-6), rod(3, 4, 0.0), rod(5, 6, 1e-5);
  b.constraint("hinge", {0, 1, 2}, 1e-3, {0.0, 0.0, 1.0, 0.54});
  b.spec.groups[0].damped = true;
  b.balls({0, 2, 3, 5}, {0.012, 0.013, 0.014, 0.012}, 0.8);
  Sample s = b.build(0.0);
  for (int i = 0; i < 4; ++i) s.inputs[s.scene.layout.of(Quantity::damping) + i] = i == 1 ? 0.05 : 0.01 * i;
  return s;
}

class StrungBalls : public ::testing::TestWithParam<Strung> {
 protected:
  static Program of(const Sample& s) {
    Program p = program(s, 2e-3, 0.08, GetParam().integrator);
    p.plan.options.partition = GetParam().partition;
    p.plan = make_plan(s.scene, p.plan.options);
    return p;
  }
};
INSTANTIATE_TEST_SUITE_P(Collisions, StrungBalls,
                         ::testing::Values(Strung{strung_balls, Partition::implicit, Integrator::bdf1},
                                           Strung{strung_balls, Partition::implicit, Integrator::bdf2},
                                           Strung{strung_balls, Partition::gauss_seidel, Integrator::bdf1},
                                           Strung{strung_balls, Partition::gauss_seidel, Integrator::bdf2},
                                           Strung{balls_on_rods, Partition::implicit, Integrator::bdf1},
                                           Strung{balls_on_rods, Partition::gauss_seidel, Integrator::bdf2},
                                           Strung{balls_on_rods, Partition::direct, Integrator::bdf1}));

TEST_P(StrungBalls, HaveTheGradientOfComplexSteps) {
  const Sample s = GetParam().scene();
  const Program p = of(s);
  Rollout<double> rollout(s.scene, p.plan, s.inputs.data());
  std::set<int> hit;
  for (int n = 0; n < p.steps; ++n) {
    rollout.advance();
    for (const auto& impact : rollout.impacts())
      for (const auto& flown : impact.flown()) hit.insert(flown.node);
  }
  std::set<int> balls;
  for (const Bouncer& ball : s.scene.balls.members) balls.insert(ball.node);
  EXPECT_EQ(hit, balls);
  if (!s.scene.contacts.empty()) {
    EXPECT_GT(times_touching(p, s.inputs), 3);
  }
  const auto loss_of = [&](const std::vector<Complex>& probe) { return loss(p, probe); };
  expect_sums_agree(s.scene.layout, loss_of, s.inputs, gradient(p, s.inputs), 1e-8);
}

TEST_P(StrungBalls, HaveTheSameBitsWhateverKeepsTheirStates) {
  const Sample s = GetParam().scene();
  const Program p = of(s);
  expect_bits_of_any_tape(p, s.inputs);
  InputsOfLanes inputs(Pack::lanes, s.inputs);
  inputs[3][s.scene.layout.of(Quantity::velocity) + 2] = -0.9;
  expect_bits_of_lanes(p, inputs, {3, 5}, Schedule::least(p.steps, Tape<double>::window(p.plan)));
}

TEST(Collisions, AreTheSameHoweverBallsAreNumbered) {
  const auto ends = [](bool turned) {
    ContactBuilder b;
    const Vec3<double> x[3] = {{0.0, 0.0, 0.0}, {0.3, 0.02, 0.0}, {0.55, 0.0, 0.03}};
    const Vec3<double> v[3] = {{2.0, 0.0, 0.0}, {0.0, 0.1, 0.0}, {-1.0, 0.0, 0.2}};
    for (int i = 0; i < 3; ++i) {
      const int k = turned ? 2 - i : i;
      b.particle(x[k], 0.1 + 0.1 * k, v[k]);
    }
    b.balls({0, 1, 2}, std::vector<double>(3, 0.05), 0.9);
    const Sample s = b.build(g);
    const Program p = program(s, 5e-3, 0.5, Integrator::bdf2);
    const auto all = states(p, s.inputs);
    std::vector<double> found;
    for (int i = 0; i < 3; ++i)
      for (int d = 0; d < 3; ++d) found.push_back(all[p.steps * s.scene.dofs() + 3 * (turned ? 2 - i : i) + d]);
    return found;
  };
  EXPECT_LE(relative_error(ends(true), ends(false)), 1e-12);
}

TEST(Collisions, AreRefusedOfWhatIsPinned) {
  const auto make = [](const std::function<void(ContactBuilder&)>& change) {
    ContactBuilder b;
    b.particle({0.0, 0.0, 0.1}, 0.1), b.particle({0.1, 0.0, 0.1}, 0.1), b.particle({0.2, 0.0, 0.1}, 0.1);
    b.balls({0, 1}, {0.01, 0.01}, 0.5);
    change(b);
    return b.build(g);
  };
  EXPECT_NO_THROW(make([](ContactBuilder&) {}));
  EXPECT_NO_THROW(make([](ContactBuilder& b) { b.constraint("distance", {1, 2}, 1e-3, {0.1}); }));
  EXPECT_THROW(make([](ContactBuilder& b) { b.spec.pinned = {1}; }), std::invalid_argument);
  EXPECT_THROW(make([](ContactBuilder& b) { b.spec.balls = {0, 0}; }), std::invalid_argument);
  EXPECT_THROW(make([](ContactBuilder& b) { b.spec.balls = {0}; }), std::invalid_argument);
  EXPECT_THROW(make([](ContactBuilder& b) { b.spec.balls = {0, 7}; }), std::invalid_argument);
}

}  // namespace
}  // namespace sheetbend::testing
