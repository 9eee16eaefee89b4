// BDF2 through impacts: second order, no bounce, and BDF2 itself where nothing touches.
#include <numbers>

#include "core/rollout/rollout.h"
#include "tests/cpp/support/contact_scenes.h"

namespace sheetbend::testing {
namespace {

constexpr double g = 9.81;

// A particle that falls from a height and slides.
struct Landing {
  double x, highest;  // where it comes to rest, and how high it is at most after it has touched
  double by_height, by_speed, by_friction;
  int first_order;  // substeps
};
Landing land(double h) {
  ContactBuilder b;
  b.particle({0.0, 0.0, 0.1}, 0.2, {2.0, 0.0, 0.0});
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  b.contact(0.3, 0.0);
  const Sample s = b.build(g);
  const Program p{s.scene, make_plan(s.scene, contact_options(h, Integrator::bdf2)),
                  static_cast<int>(std::lround(0.8 / h))};
  Rollout<double> rollout(s.scene, p.plan, s.inputs.data());
  Landing found{0.0, -1.0, 0.0, 0.0, 0.0, 0};
  bool touched = false;
  for (int n = 0; n < p.steps; ++n) {
    rollout.advance();
    touched |= rollout.x()[2] < 0.0;
    if (touched) found.highest = std::max(found.highest, rollout.x()[2]);
    found.first_order += rollout.first_order();
  }
  found.x = rollout.x()[0];
  std::vector<double> seed(s.scene.dofs());
  seed[0] = 1.0;
  const auto bar = gradient_of_end(p, s.inputs, seed);
  const Inputs<const double> in{s.scene.layout, bar.data()};
  found.by_height = in.of(Quantity::position)[2];
  found.by_speed = in.of(Quantity::velocity)[0];
  found.by_friction = in.of(Quantity::friction)[0];
  return found;
}

TEST(Impact, IsOfSecondOrderWithoutABounce) {
  constexpr double mu = 0.3, v = 2.0, h0 = 0.1;
  const double fall = std::sqrt(2.0 * h0 / g), left = v - mu * g * fall;
  const double x = v * fall + left * left / (2.0 * mu * g);  // 0.709579
  double before = 0.0;
  for (const int rate : {240, 480, 960, 1920}) {
    const Landing found = land(1.0 / rate);
    const double error = std::abs(found.x - x);
    EXPECT_LE(found.highest, 1e-9);
    EXPECT_NEAR(found.by_height, mu, 1e-4);
    EXPECT_EQ(found.first_order, 4);
    if (before > 0.0) {
      EXPECT_NEAR(before / error, 4.0, 1.0);
    }
    before = error;
  }
  EXPECT_LE(before, 3e-6);
}

// A particle that comes in at 5 m/s is never deeper than h/1000 of its speed, wherever in a substep it arrives.
TEST(Impact, IsNoDeeperThanAThousandthOfTheWayOfASubstep) {
  constexpr double h = 1e-3, v = 5.0;
  for (const Integrator integrator : {Integrator::bdf1, Integrator::bdf2})
    for (int phase = 0; phase < 10; ++phase) {
      ContactBuilder b;
      b.particle({0.0, 0.0, (4.0 + 0.1 * phase) * v * h}, 0.2, {1.0, 0.0, -v});
      b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
      b.contact(0.3, 0.0);
      const Sample s = b.build(g);
      const Plan plan = make_plan(s.scene, contact_options(h, integrator));
      Rollout<double> rollout(s.scene, plan, s.inputs.data());
      double lowest = 0.0;
      for (int n = 0; n < 20; ++n) {
        rollout.advance();
        lowest = std::min(lowest, rollout.x()[2]);
      }
      EXPECT_LT(lowest, 0.0);
      EXPECT_GE(lowest, -(v + 5.0 * g * h) * h / rigidity);
    }
}

// A rope far above a plane, and the same rope without one.
TEST(Impact, LeavesFreeFlightAsItIs) {
  const auto fly = [](bool above) {
    ContactBuilder b;
    for (int i = 0; i < 5; ++i) b.particle({0.05 * i, 0.01 * i * i, 10.0}, 0.002, {0.3 * i, 0.1, 0.2 * i});
    for (int i = 0; i < 4; ++i) b.constraint("distance", {i, i + 1}, 0.05 / 50.0, {0.05});
    for (int i = 0; i < 3; ++i) b.constraint("bend", {i, i + 1, i + 2}, 0.05 / 1e-4, {});
    if (above) {
      b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
      b.contact(0.3, 0.0);
    }
    const Sample s = b.build(g);
    const Plan plan = make_plan(s.scene, contact_options(1e-3, Integrator::bdf2));
    Rollout<double> rollout(s.scene, plan, s.inputs.data());
    std::vector<double> all;
    for (int n = 0; n < 40; ++n) {
      rollout.advance();
      EXPECT_EQ(rollout.first_order() != 0, n == 0);
      all.insert(all.end(), rollout.x(), rollout.x() + 15);
    }
    return all;
  };
  EXPECT_TRUE(same_bits(fly(true), fly(false)));
}

// A particle that falls on an elastic contact and comes up again, as high as it was.
struct Rebounding {
  double error;     // of its height at 0.12 s
  int first_order;  // substeps
};
Rebounding rebound_off(double omega, double h) {
  constexpr double m = 0.2, h0 = 0.02, seconds = 0.12;
  ContactBuilder b;
  b.particle({0.0, 0.0, h0}, m);
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  b.contact(0.0, 0.0, m * omega * omega);
  const Sample s = b.build(g);
  const Plan plan = make_plan(s.scene, contact_options(h, Integrator::bdf2));
  Rollout<double> rollout(s.scene, plan, s.inputs.data());
  Rebounding found{0.0, 0};
  for (int n = 0; n < std::lround(seconds / h); ++n) {
    rollout.advance();
    found.first_order += rollout.first_order();
  }
  const double v = std::sqrt(2.0 * g * h0), touching = 2.0 * (std::numbers::pi - std::atan(v * omega / g)) / omega;
  const double up = seconds - v / g - touching;
  found.error = std::abs(rollout.x()[2] - (v * up - 0.5 * g * up * up));
  return found;
}

// Substeps that follow the vibration of a soft contact go through it with BDF2.
TEST(Impact, OnSoftContactsIsOneForceAmongOthers) {
  constexpr double omega = 100.0;
  const Rebounding coarse = rebound_off(omega, 0.5 / omega), fine = rebound_off(omega, 0.0625 / omega);
  EXPECT_EQ(coarse.first_order, 1);
  EXPECT_EQ(fine.first_order, 1);
  EXPECT_LE(fine.error, coarse.error / 30.0);
  EXPECT_LE(fine.error, 3e-5);
  EXPECT_GT(rebound_off(1.2 * omega, 0.5 / omega).first_order, 1);
}

}  // namespace
}  // namespace sheetbend::testing
