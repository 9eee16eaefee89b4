// Capsules of bodies that touch ropes, cloths and each other: momentum, gradients against complex steps, equal bits, and that nothing passes through.
#include "core/rollout/rollout.h"
#include "tests/cpp/support/lanes.h"
#include "tests/cpp/support/self_contact_scenes.h"

namespace sheetbend::testing {
namespace {

constexpr double g = 9.81;

// A bar that turns falls across a rope, whose ends are held, and its end meets a post, which is a body that is held.
Sample bar_on_a_rope(double mu) {
  TouchingBuilder b;
  b.rope(line({-0.08, 0.003, 0.0}, {0.04, 0.0, 0.001}, 5), 0.003, {0.0, 0.0, 0.0}, 0.005);
  b.spec.pinned = {0, 4};
  const int bar = b.body(0.02, {2e-6, 1.9e-5, 1.95e-5}, {0.004, 0.02, 0.014}, {0.05, 0.1, 1.5}, {0.1, 0.05, -0.6},
                         {2.0, 1.0, -3.0});
  b.capsules(bar, {{{{-0.06, 0.001, 0.0}, {0.05, -0.001, 0.001}}}}, 0.007);
  const int post = b.held_body({0.01, 0.055, -0.012}, {0.1, 0.2, 0.3});
  b.capsules(post, {{{{-0.03, 0.0, 0.0}, {0.03, 0.002, 0.001}}}}, 0.006);
  if (mu > 0.0) b.rub(mu, 12);
  return b.build(g);
}

// Two crossed bars in one body fall on a sheet, whose corners are held, and a third bar falls on them.
Sample bodies_on_a_sheet(double mu) {
  TouchingBuilder b;
  const double e = 0.04;
  b.sheet(
      2, 2, [&](int i, int j) { return Vec3<double>(e * i, e * j, 0.002 * i * j); }, 0.002, {0.0, 0.0, 0.0}, 0.003,
      400.0);
  b.spec.pinned = {0, 2, 6, 8};
  const int cross = b.body(0.006, {1.5e-6, 1.6e-6, 2.9e-6}, {0.037, 0.041, 0.022}, {0.02, 0.1, 0.4}, {0.1, -0.2, -1.0},
                           {1.0, -2.0, 3.0});
  b.capsules(cross, {{{{-0.027, 0.0, 0.0}, {0.029, 0.001, 0.001}}}, {{{0.0, -0.028, 0.0}, {0.001, 0.026, 0.002}}}},
             0.004);
  const int bar =
      b.body(0.004, {3e-7, 1.1e-6, 1.2e-6}, {0.03, 0.05, 0.034}, {0.1, 0.0, 1.2}, {0.0, 0.1, -1.6}, {0.0, 1.0, 2.0});
  b.capsules(bar, {{{{-0.02, 0.0, 0.0}, {0.021, 0.0, 0.001}}}}, 0.003);
  if (mu > 0.0) b.rub(mu, 30);
  return b.build(g);
}

using BodyPairs = TouchingTest;

TEST_P(BodyPairs, BeginAndEnd) {
  int points = 0, between_bodies = 0, of_held = 0;
  const SelfContact& own = s.scene.self_contact;
  const Course course = run([&](const Rollout<double>&, const std::vector<PairKey>& now) {
    for (const PairKey& key : now) {
      const auto spots = spots_of(own, key);
      const int first = spots[0], second = spots[key.triangle ? 1 : 2];
      EXPECT_NE(own.whole(first), own.whole(second));
      points += key.triangle && first >= own.nodes;
      between_bodies += first >= own.nodes && second >= own.nodes;
      for (const int spot : {first, second}) of_held += s.scene.role[own.whole(spot)] == Role::pinned;
    }
  });
  const bool cloth = !own.triangles.empty();
  EXPECT_GT(course.began, 1);
  EXPECT_GT(course.ended, 1);
  EXPECT_GE(points, cloth ? 3 : 0);
  EXPECT_GE(between_bodies, 3);
  EXPECT_GE(of_held, cloth ? 0 : 3);
  EXPECT_LE(static_cast<double>(course.matrices) / p.steps, 12.0);
}

TEST_P(BodyPairs, HaveTheGradientOfComplexSteps) {
  const auto of = [&](const std::vector<Complex>& probe) { return loss(p, probe); };
  expect_sums_agree(s.scene.layout, of, s.inputs, gradient(p, s.inputs), 1e-8);
}

TEST_P(BodyPairs, HaveTheTangentsOfComplexSteps) {
  const Layout& layout = s.scene.layout;
  const std::size_t last = GetParam().friction > 0.0 ? layout.of(Quantity::friction) : layout.of(Quantity::mass) + 1;
  expect_tangents_agree(p, s.inputs,
                        {layout.of(Quantity::contact_radius) + 1, layout.of(Quantity::contact_weight) + 1, last,
                         layout.of(Quantity::mass) + s.scene.bodies[0].axes[1]},
                        1e-8);
}

TEST_P(BodyPairs, HaveTheSameBitsWhateverKeepsTheirStates) {
  Program half = p;
  half.steps /= 2;
  expect_bits_of_any_tape(half, s.inputs);
  const Layout& layout = s.scene.layout;
  InputsOfLanes inputs(Pack::lanes, s.inputs);
  inputs[3][layout.of(Quantity::gravity) + 2] = -9.5;
  inputs[4][layout.of(Quantity::contact_weight) + 5] *= 0.9;
  expect_bits_of_lanes(half, inputs, {3, 4, 5});
}

INSTANTIATE_TEST_SUITE_P(Bodies, BodyPairs,
                         ::testing::Values(TouchingCase{bar_on_a_rope, Integrator::bdf1, 60},
                                           TouchingCase{bar_on_a_rope, Integrator::bdf2, 60},
                                           TouchingCase{bodies_on_a_sheet, Integrator::bdf1, 50},
                                           TouchingCase{bar_on_a_rope, Integrator::bdf2, 60, 0.2},
                                           TouchingCase{bodies_on_a_sheet, Integrator::bdf1, 50, 0.3}));

// A bar and a rope meet in flight: forces leave momentum as it is, and the moment of all forces is zero, axes counted as the nodes that they are.
TEST(BarInFlight, KeepsMomentum) {
  TouchingBuilder b;
  b.rope(line({-0.06, 0.004, 0.0}, {0.03, 0.0, 0.002}, 5), 0.003, {0.0, 0.0, 0.0}, 0.005);
  const int bar =
      b.body(0.02, {2e-6, 1.9e-5, 1.95e-5}, {0.01, 0.01, 0.02}, {0.05, 0.1, 1.5}, {0.1, 0.05, -1.0}, {2.0, 1.0, -3.0});
  b.capsules(bar, {{{{-0.06, 0.0, 0.0}, {0.05, 0.0, 0.001}}}}, 0.007);
  const Sample s = b.build(0.0);
  const Plan plan = make_plan(s.scene, contact_options(1e-3));
  Rollout<double> rollout(s.scene, plan, s.inputs.data());
  const double* v = rollout.state().v;
  std::vector<double> before(v, v + s.scene.dofs());
  const auto momentum = [&](int n, const double* of) { return b.mass[n] * Vec3<double>(of + 3 * n); };
  int touched = 0;
  double most = 0.0, pushed = 0.0;
  for (int n = 0; n < 60; ++n) {
    rollout.advance();
    v = rollout.state().v;
    touched += !touching(rollout, s.scene, s.inputs).empty();
    Vec3<double> change(0.0, 0.0, 0.0), turned = change;
    for (int node = 0; node < s.scene.nodes(); ++node) {
      const Vec3<double> own = momentum(node, v) - momentum(node, before.data());
      if (node <= bar) change = change + own;  // what is behind it are its axes
      turned = turned + cross(Vec3<double>(rollout.x() + 3 * node), own);
    }
    pushed = std::max(pushed, norm(momentum(bar, v) - momentum(bar, before.data())));
    most = std::max({most, norm(change), norm(turned) / 0.1});
    before.assign(v, v + s.scene.dofs());
  }
  EXPECT_GT(touched, 5);
  EXPECT_GT(pushed, 1e-3);
  record_error("momentum_of_bar", most / 0.02);
  EXPECT_LE(most, 1e-12 * 0.02);
}

// A bar lies across two edges that are held, on a slope of 30 degrees: it slides as Coulomb says, x = (sin - mu cos) g t^2/2.
TEST(BarOnASlope, SlidesAsCoulombSays) {
  const double D = 0.01, h = 1e-3, lean = 0.5 * std::sqrt(3.0);
  const int steps = 200;
  for (const double mu : {0.3, 0.578}) {
    TouchingBuilder b;
    for (const double y : {-0.03, 0.03}) b.held_edge({-0.5, y, 0.0}, {0.5, y, 0.0}, 0.5 * D);
    const int bar = b.body(0.02, {2e-6, 1.9e-5, 1.9e-5}, {0.0, 0.0, D - 1e-8}, {0.0, 0.0, 0.5 * M_PI}, {}, {});
    b.capsules(bar, {{{{-0.05, 0.0, 0.0}, {0.05, 0.0, 0.0}}}}, 0.5 * D);
    b.rub(mu, 4);
    Sample s = b.build(g);
    Vec3<double>(0.5 * g, 0.0, -lean * g).store(Inputs<double>{s.scene.layout, s.inputs.data()}.of(Quantity::gravity));
    const Plan plan = make_plan(s.scene, contact_options(h));
    Rollout<double> rollout(s.scene, plan, s.inputs.data());
    for (int n = 0; n < steps; ++n) rollout.advance();
    const double* x = rollout.x() + 3 * bar;
    const double path = 0.5 * g * h * h * steps * (steps + 1);
    EXPECT_NEAR(x[0], mu > 0.577 ? 0.0 : (0.5 - mu * lean) * path, 1e-4 * path) << mu;
    EXPECT_NEAR(x[2], D - 0.5 * segment_softness * D * 0.3 * 0.3, 3e-7) << mu;  // nearest_points: it is softened
  }
}

// A bar flies at a rope by up to five times the distance at which they touch in a substep.
TEST(BarInFlight, PassesNothingHoweverFast) {
  for (const double speed : {2.0, 20.0, 50.0}) {
    TouchingBuilder b;
    b.rope(line({-0.06, 0.002, 0.0}, {0.03, 0.0, 0.0}, 5), 0.003, {0.0, 0.0, 0.0}, 0.005, 2000.0);
    b.spec.pinned = {0, 4};
    const int bar = b.body(0.004, {4e-7, 4e-6, 4e-6}, {0.004, 0.003, 0.03 + 0.0023 * speed}, {0.0, 0.0, 1.5},
                           {0.0, 0.0, -speed}, {});
    b.capsules(bar, {{{{-0.06, 0.0, 0.0}, {0.06, 0.0, 0.0}}}}, 0.005);
    const Sample s = b.build(0.0);
    const Plan plan = make_plan(s.scene, contact_options(1e-3));
    Rollout<double> rollout(s.scene, plan, s.inputs.data());
    bool touched = false;
    double nearest = 1.0;
    for (int n = 0; n < static_cast<int>(3 + 40.0 / speed) + 15; ++n) {
      rollout.advance();
      touched = touched || !touching(rollout, s.scene, s.inputs).empty();
      const std::vector<double> x = spot_places(rollout, s.scene, s.inputs);
      const int last = static_cast<int>(s.scene.self_contact.edges.size()) - 1;  // the bar
      for (int link = 0; link < last; ++link) {
        double at[12];
        gather(spots_of(s.scene.self_contact, {false, link, last}), x.data(), 3, at);
        nearest = std::min(nearest, distance_of(false, at, {0.01, 1.0}));
      }
    }
    EXPECT_TRUE(touched) << speed;
    EXPECT_GT(nearest, 0.01 - 2e-6 * speed) << speed;
  }
}

TEST(BodyPairs, AreRefusedWhereTheyCannotBe) {
  const auto build = [](auto&& spoil) {
    TouchingBuilder b;
    b.rope(line({-0.06, 0.0, 0.0}, {0.03, 0.0, 0.0}, 3), 0.003, {}, 0.005);
    const int bar = b.body(0.004, {4e-7, 4e-6, 4e-6}, {0.0, 0.0, 0.05}, {}, {}, {});
    b.capsules(bar, {{{{-0.06, 0.0, 0.0}, {0.06, 0.0, 0.0}}}}, 0.005);
    spoil(b);
    return b.build(0.0);
  };
  EXPECT_NO_THROW(build([](TouchingBuilder&) {}));
  EXPECT_THROW(build([](TouchingBuilder& b) { b.spec.self_contact.on_bodies[0][3] = 0; }), std::invalid_argument);
  EXPECT_THROW(build([](TouchingBuilder& b) { b.spec.self_contact.on_bodies[0][0] = 99; }), std::invalid_argument);
  EXPECT_THROW(build([](TouchingBuilder& b) { b.spec.self_contact.pieces[1].edges[0][1] = 99; }),
               std::invalid_argument);
  EXPECT_THROW(build([](TouchingBuilder& b) { b.spec.self_contact.pieces.pop_back(); }), std::invalid_argument);
  EXPECT_THROW(build([](TouchingBuilder& b) { b.spec.pinned = {4}; }), std::invalid_argument);
}

}  // namespace
}  // namespace sheetbend::testing
