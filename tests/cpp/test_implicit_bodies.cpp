// Rigid bodies in implicit blocks: the motion of `direct`, points of bodies in contact, and their gradients against complex steps.
#include "core/rollout/rollout.h"
#include "tests/cpp/support/contact_scenes.h"
#include "tests/cpp/support/lanes.h"

namespace sheetbend::testing {
namespace {

constexpr double g = 9.81, edge = 0.1, mass = 0.37;
constexpr double moment = mass * edge * edge / 6.0;

std::vector<Vec3<double>> corners(double x, double y, double z) {
  std::vector<Vec3<double>> all;
  for (int k = 0; k < 8; ++k)
    all.push_back(Vec3<double>(((k & 1) - 0.5) * x, ((k >> 1 & 1) - 0.5) * y, ((k >> 2) - 0.5) * z));
  return all;
}

struct Toss {
  double mu = 0.2, restitution = -1.0;
  bool cable = false, ball = false;  // a soft cord on a corner, held by rigid rows; a ball instead of a plane
};

// A box with three different moments, whose corners touch.
Sample tossed(const Toss& toss) {
  ContactBuilder b;
  const Vec3<double> at(0.0, 0.0, 0.12), turn(0.5, 0.3, 0.2), v(0.8, 0.1, -0.5), omega(1.0, -3.0, 2.0);
  const int box = b.body(mass, {moment, 0.9 * moment, 1.1 * moment}, at, turn, v, omega);
  if (toss.cable) {
    double R[9];
    turn_by(turn, R);
    const double c = 0.5 * edge;
    const Vec3<double> arm(c * (R[0] + R[1] + R[2]), c * (R[3] + R[4] + R[5]), c * (R[6] + R[7] + R[8]));
    const int near = b.particle(at + arm, 0.01, v + cross(omega, arm)),
              far = b.particle(at + arm + Vec3<double>(0.05, 0.0, 0.02), 0.01, v);
    b.constraint("coincide_particle", {box, near, box + 1, box + 2, box + 3}, 0.0, {c, c, c});
    b.constraint("distance", {near, far}, 0.05 / 200.0, {0.05});
  }
  if (toss.ball)
    b.collider("sphere", {0.5}, {0.0, 0.0, -0.5, 0.0, 0.0, 0.0});
  else
    b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  b.contact_of(box, corners(edge, edge, edge), toss.mu, 0.0, toss.restitution);
  return b.build(g);
}

// Balances end at 1e-12 of the largest force: at 1e-10 gradients are some 1e-9 from complex steps, by where each of both ended.
SolverOptions exact_options(Integrator integrator) {
  SolverOptions options = contact_options(2e-3, integrator);
  options.force_tolerance = 1e-12;
  return options;
}

struct TossedBox : ::testing::TestWithParam<std::tuple<Toss, Integrator>> {
  Sample sample = tossed(std::get<0>(GetParam()));
  Program program = moving_program(sample, exact_options(std::get<1>(GetParam())), 60);
};
INSTANTIATE_TEST_SUITE_P(Bodies, TossedBox,
                         ::testing::Values(std::tuple{Toss{}, Integrator::bdf1}, std::tuple{Toss{}, Integrator::bdf2},
                                           std::tuple{Toss{.mu = 0.5, .cable = true}, Integrator::bdf1},
                                           std::tuple{Toss{.mu = 0.0, .ball = true}, Integrator::bdf1},
                                           std::tuple{Toss{.mu = 0.3, .cable = true, .ball = true}, Integrator::bdf2}));

TEST_P(TossedBox, TouchesSlidesAndHasTheGradientOfComplexSteps) {
  EXPECT_GE(times_touching(program, sample.inputs), 5);
  const auto of = [&](const std::vector<Complex>& probe) { return loss(program, probe); };
  expect_sums_agree(sample.scene.layout, of, sample.inputs, gradient(program, sample.inputs), 1e-9);
}

TEST_P(TossedBox, HasTheSameBitsWhateverKeepsItsStates) {
  expect_bits_of_any_tape(program, sample.inputs);
  InputsOfLanes inputs(Pack::lanes, sample.inputs);
  inputs[3][sample.scene.layout.of(Quantity::gravity) + 2] = -9.5;
  inputs[4][sample.scene.layout.of(Quantity::contact_weight) + 2] *= 1.1;
  expect_bits_of_lanes(program, inputs, {3, 4, 5});
}

TEST(BouncingBox, HasTheGradientOfComplexSteps) {
  const Sample s = tossed({.mu = 0.2, .restitution = 0.4});
  const Program p = moving_program(s, contact_options(2e-3), 40);
  const auto of = [&](const std::vector<Complex>& probe) { return loss(p, probe); };
  expect_sums_agree(s.scene.layout, of, s.inputs, gradient(p, s.inputs), 1e-6);
}

// On 30 degrees a block slides with a friction below tan(30 degrees) and stays with one above it.
TEST(BlockOnAnIncline, SlidesBelowTheAngleOfFrictionAndStaysAboveIt) {
  constexpr double angle = M_PI / 6.0, h = 1e-3;
  const auto moved = [&](double mu, double seconds) {
    ContactBuilder b;
    const double up = 0.02 + 1e-9;
    const int block =
        b.body(0.5, {1e-3, 2e-3, 2.5e-3}, {up * std::sin(angle), 0.0, up * std::cos(angle)}, {0.0, angle, 0.0}, {}, {});
    b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, angle, 0.0});
    b.contact_of(block, corners(0.2, 0.1, 0.04), mu, 0.0);
    const Sample s = b.build(g);
    const Plan plan = make_plan(s.scene, contact_options(h));
    Rollout<double> rollout(s.scene, plan, s.inputs.data());
    for (int n = 0; n < static_cast<int>(seconds / h); ++n) rollout.advance();
    const double* x = rollout.x() + 3 * block;
    return (x[0] - up * std::sin(angle)) * std::cos(angle) - (x[2] - up * std::cos(angle)) * std::sin(angle);
  };
  const double stays = moved(0.578, 2.0), slides = moved(0.577, 2.0);
  record_error("block_stays", std::abs(stays));
  EXPECT_LE(std::abs(stays), 1e-7);
  const double expected = 0.5 * g * (std::sin(angle) - 0.577 * std::cos(angle)) * 4.0;
  EXPECT_NEAR(slides, expected, 0.02 * expected);
}

}  // namespace
}  // namespace sheetbend::testing
