// Joints between bodies: oracles of pendulums and springs, and the gradients of all their numbers.
#include <gtest/gtest.h>

#include "adjoint/rollout/rollout.h"
#include "core/scalar/complex.h"
#include "tests/cpp/support/joints.h"
#include "tests/cpp/support/programs.h"

namespace sheetbend::testing {
namespace {

constexpr double pi = 3.14159265358979323846;

std::vector<double> trajectory(const Scene& scene, const std::vector<double>& inputs, double h, int steps,
                               int every = 1, int iterations = 2) {
  const Plan plan = make_plan(scene, {.h = h, .partition = Partition::direct, .iterations = iterations});
  std::vector<int> kept;
  for (int n = 0; n <= steps; n += every) kept.push_back(n);
  std::vector<double> x(kept.size() * scene.dofs());
  rollout_states<double>(scene, plan, inputs.data(), 0.0, kept, x.data(), nullptr);
  return x;
}

// A link that swings in the plane of x and z: its first axis points from its upper joint to its center, `below` away; its second is the hinge's.
struct Link {
  double mass, inertia, below;
};

// Links hinged one below the other from the ground, `length` apart.
std::vector<Body> chain(BodyScene& s, const std::vector<Link>& links, double length,
                        const std::vector<double>& angles) {
  Body above = ground(s);
  std::vector<Body> bodies;
  Vec3<double> joint{};
  for (std::size_t k = 0; k < links.size(); ++k) {
    const auto R = hanging(angles[k]);
    const double I = links[k].inertia;
    const Body b = s.add_body(joint + links[k].below * R[0], links[k].mass, {0.6 * I, I, 0.7 * I}, R);
    const double last = k == 0 ? 0.0 : length - links[k - 1].below;
    hinge(s, above, {last, 0, 0}, b, {-links[k].below, 0, 0});
    joint = joint + length * R[0];
    bodies.push_back(above = b);
  }
  return bodies;
}

double angle_of(const Scene& scene, const double* x, const Body& b) {
  const double* a = x + scene.first_dof[b.axes[0]];
  return std::atan2(a[0], -a[2]);
}

TEST(RodPendulum, SwingsWithItsPeriod) {
  constexpr double L = 1.0, r = 0.01, h = 1.0 / 240, exact = 1.6380080;
  BodyScene s;
  const int pivot = s.add_node({}, 1.0);
  s.spec.pinned = {pivot};
  const auto R = hanging(1e-3);
  const double across_ = (3 * r * r + L * L) / 12;
  const Body rod = s.add_body(0.5 * L * R[0], 1.0, {0.5 * r * r, across_, across_}, R);
  s.add("coincide_particle", {rod.center, pivot, rod.axes[0], rod.axes[1], rod.axes[2]}, {-0.5 * L, 0, 0});
  const Scene scene = build_scene(s.spec);
  const auto x = trajectory(scene, s.inputs(scene), h, 10 * 240);
  std::vector<double> crossings;
  for (int n = 1; n <= 10 * 240; ++n) {
    const double before = angle_of(scene, &x[(n - 1) * scene.dofs()], rod),
                 now = angle_of(scene, &x[n * scene.dofs()], rod);
    if (before > 0.0 && now <= 0.0) crossings.push_back(h * (n - 1 + before / (before - now)));
  }
  const double period = (crossings.back() - crossings.front()) / (static_cast<double>(crossings.size()) - 1.0);
  record_error("period", period - exact);
  EXPECT_NEAR(period / exact, 1.0, 3e-5);
}

// A wheel on a hinge with a spring: theta = theta0 cos(sqrt(k/I) t), so its derivative with respect to k is known too.
TEST(HingeSpring, SwingsWithItsPeriodAndItsDerivative) {
  constexpr double k = 0.02, I = 4e-4, theta0 = 0.3;
  const double period = 2 * pi * std::sqrt(I / k);
  double before = 0.0, before_derivative = 0.0;
  for (const int steps : {240, 480}) {
    BodyScene s;
    s.gravity = {};
    const Body still = ground(s), wheel = s.add_body({}, 0.3, {3e-4, I, 2e-4}, hanging(theta0));
    hinge(s, still, {}, wheel, {});
    const int dial = s.add_node({}, 1.0);
    s.spec.pinned.push_back(dial);
    std::vector<int> nodes(still.axes.begin(), still.axes.end());
    nodes.insert(nodes.end(), wheel.axes.begin(), wheel.axes.end());
    nodes.push_back(dial);
    s.add("joint_angle", nodes, {1, 0, 0, 0, 0, 1, 1, 0, 0, 0}, 1.0 / k);
    const Scene scene = build_scene(s.spec);
    const auto inputs = s.inputs(scene);
    const double time = 1.2 * period, omega = std::sqrt(k / I), exact = theta0 * std::cos(omega * time);
    const Program program{scene, make_plan(scene, {.h = time / steps, .partition = Partition::direct}), steps};
    std::vector<double> x(scene.dofs()), x_bar(scene.dofs()), bar(inputs.size());
    Tape<double> tape =
        record_rollout<double>(scene, program.plan, inputs.data(), 0.0, {steps}, x.data(), every_state, nullptr);
    const double* a = &x[scene.first_dof[wheel.axes[0]]];
    const double size2 = a[0] * a[0] + a[2] * a[2];
    x_bar[scene.first_dof[wheel.axes[0]]] = -a[2] / size2;
    x_bar[scene.first_dof[wheel.axes[0]] + 2] = a[0] / size2;
    reverse_rollout<double>(scene, program.plan, inputs.data(), 0.0, tape, {steps}, x_bar.data(), bar.data(), nullptr);
    const double by_k = -bar[scene.layout.of(Quantity::compliance) + scene.constraints - 1] / (k * k);
    const double exact_by_k = -theta0 * std::sin(omega * time) * time * 0.5 / std::sqrt(k * I);
    const double error = std::abs(std::atan2(a[0], -a[2]) - exact), error_by_k = std::abs(by_k - exact_by_k);
    EXPECT_LE(error, 3e-3 * theta0);
    EXPECT_LE(error_by_k, 5e-3 * std::abs(exact_by_k));
    if (before > 0.0) {
      EXPECT_NEAR(std::log2(before / error), 2.0, 0.25);
      EXPECT_NEAR(std::log2(before_derivative / error_by_k), 2.0, 0.25);
    }
    before = error, before_derivative = error_by_k;
  }
}

TEST(DoublePendulum, OfBodiesWithSmallMomentsSwingsAsOneOfPoints) {
  BodyScene s;
  const auto bodies = chain(s, {{1.0, 1e-6, 1.0}, {1.0, 1e-6, 1.0}}, 1.0, {pi / 2, pi / 2});
  const Scene scene = build_scene(s.spec);
  double before = 0.0;
  for (const int rate : {480, 960}) {
    const auto x = trajectory(scene, s.inputs(scene), 1.0 / rate, rate / 2, rate / 2, 3);
    const double* tip = &x[scene.dofs() + scene.first_dof[bodies[1].center]];
    const double error = std::hypot(tip[0] - 1.47346567, tip[2] + 1.20038944);
    record_error("tip_" + std::to_string(rate), error);
    EXPECT_LE(error, 2e-3);
    if (before > 0.0) {
      EXPECT_NEAR(before / error, 4.0, 0.5);
    }
    before = error;
  }
}

TEST(TriplePendulum, GoesWhereTheEquationsInAnglesSay) {
  BodyScene s;
  const std::vector<double> start{2.0, 1.2, 2.5}, exact{-0.2205024, 3.6357706, 12.4751056};
  const auto bodies = chain(s, {{0.23, 1.0e-3, 0.10}, {0.25, 1.1e-3, 0.10}, {0.22, 0.9e-3, 0.08}}, 0.17, start);
  const Scene scene = build_scene(s.spec);
  std::vector<std::array<double, 3>> found;
  for (const int rate : {960, 1920, 3840}) {
    const int steps = rate * 3 / 2;
    const auto x = trajectory(scene, s.inputs(scene), 1.0 / rate, steps);
    std::array<double, 3> theta;
    for (int k = 0; k < 3; ++k) {
      theta[k] = start[k];
      for (int n = 1; n <= steps; ++n)
        theta[k] += std::remainder(angle_of(scene, &x[n * scene.dofs()], bodies[k]) - theta[k], 2 * pi);
    }
    found.push_back(theta);
  }
  double halved = 0.0, finer = 0.0, extrapolated_ = 0.0;
  for (int k = 0; k < 3; ++k) {
    const auto once = [&](int i) { return (4 * found[i + 1][k] - found[i][k]) / 3; };
    halved = std::max(halved, std::abs(found[1][k] - exact[k]));
    finer = std::max(finer, std::abs(found[2][k] - exact[k]));
    extrapolated_ = std::max(extrapolated_, std::abs((8 * once(1) - once(0)) / 7 - exact[k]));
  }
  record_error("at_3840", finer);
  record_error("extrapolated", extrapolated_);
  EXPECT_NEAR(std::log2(halved / finer), 2.0, 0.4);
  EXPECT_LE(extrapolated_, 1e-3);
}

// A driven body, a hinge with a spring and a servo's dial, a slider, a thread, a particle: every number against complex step.
TEST(Joints, GradientMatchesComplexStep) {
  BodyScene s;
  const auto links = chain(s, {{0.3, 1e-3, 0.1}, {0.2, 8e-4, 0.1}}, 0.2, {0.4, 0.9});
  const Body slide = s.add_body({0.5, 0.1, -0.1}, 0.2, {1e-3, 2e-3, 1.5e-3}, hanging(0.2), {0, 3, 0});
  const int bead = s.add_node({0.6, 0.1, -0.3}, 0.05);
  const int dial = s.add_node({0.1, 0, 0}, 1.0);
  auto turn = nodes_of(links[0], links[1], false);
  turn.push_back(dial);
  s.add("joint_angle", turn, {1, 0, 0, 0, 0, 1, 1, 0, 0, 0.2}, 5.0, 1e-3);
  s.add("body_distance", nodes_of(links[1], slide, true), {0.05, 0.02, 0.0, 0.01, 0.0, 0.03, 0.3}, 1e-4);
  s.add("along", nodes_of(links[1], slide, true), {0.0, 0.02, 0.0, 0.01, 0.0, 0.03, 0.6, 0.0, 0.8, 0.1}, 1e-2);
  s.add("coincide_particle", {slide.center, bead, slide.axes[0], slide.axes[1], slide.axes[2]}, {0.2, 0.01, 0.1}, 1e-4);
  s.add("body_particle_distance", {links[0].center, bead, links[0].axes[0], links[0].axes[1], links[0].axes[2]},
        {0.02, 0.01, 0.1, 0.6}, 1e-3);
  s.spec.driven = {dial};
  s.spec.boundary.times = {0.0, 0.1, 0.3};
  const Scene scene = build_scene(s.spec);
  auto inputs = s.inputs(scene);
  for (int k = 0; k < 3; ++k) inputs[scene.layout.of(Quantity::boundary) + 3 * k] = 0.1 + 0.3 * k;
  const Program program{scene, make_plan(scene, {.h = 4e-3, .partition = Partition::direct, .iterations = 2}), 60};
  const auto oracle = complex_step_gradient([&](const std::vector<Complex>& z) { return loss(program, z); }, inputs);
  const auto found = gradient(program, inputs);
  for (const Quantity q : {Quantity::position, Quantity::velocity, Quantity::mass, Quantity::compliance,
                           Quantity::damping, Quantity::rest, Quantity::boundary, Quantity::gravity})
    expect_quantity_agrees(scene.layout, q, found, oracle, 1e-9);
}

// A pendulum that swings onto a stop and a body that falls onto one, with damping: from before they are met until after they are left.
struct Stops : ::testing::TestWithParam<SolverOptions> {};
const std::vector<SolverOptions> solvers{
    {.h = 2e-3, .partition = Partition::direct, .iterations = 3},
    {.h = 2e-3, .integrator = Integrator::bdf1, .partition = Partition::direct, .iterations = 3},
    {.h = 2e-3, .partition = Partition::gauss_seidel, .iterations = 10}};
std::string solver_name(const ::testing::TestParamInfo<SolverOptions>& info) {
  return std::vector<std::string>{"Direct", "DirectBdf1", "Sweeps"}[info.index];
}
INSTANTIATE_TEST_SUITE_P(, Stops, ::testing::ValuesIn(solvers), solver_name);

TEST_P(Stops, GradientThroughTheirTouchMatchesComplexStep) {
  BodyScene s;
  const Body still = ground(s), link = s.add_body(0.1 * hanging(0.6)[0], 0.3, {6e-4, 1e-3, 7e-4}, hanging(0.6)),
             weight = s.add_body({0.5, 0.1, -0.1}, 0.2, {1e-3, 2e-3, 1.5e-3}, hanging(0.0));
  hinge(s, still, {}, link, {-0.1, 0, 0});
  s.add("angle_stop", nodes_of(still, link, false), {1, 0, 0, 0, 0, 1, 1, 0, 0, 0.35, 0.45, 0.02}, 0.01, 0.13);
  s.add("slide_stop", nodes_of(still, weight, true), {0.12, 0.0, 0.5, 0.02, 0.01, 0.01, 1, 0, 0, 0.0, 0.05, 0.005},
        2e-4, 6.0);
  const Scene scene = build_scene(s.spec);
  const auto inputs = s.inputs(scene);
  constexpr int steps = 140;
  const Program program{scene, make_plan(scene, GetParam()), steps};
  const auto all = states(program, inputs);
  const auto angle = [&](int n) { return angle_of(scene, &all[static_cast<std::size_t>(n) * scene.dofs()], link); };
  double deepest = 0.0;
  for (int n = 0; n <= steps; ++n) deepest = std::min(deepest, angle(n) + 0.1);
  EXPECT_LT(deepest, -0.01);      // beyond the limit of -0.1 rad
  EXPECT_GT(angle(steps), -0.1);  // and back
  const auto oracle = complex_step_gradient([&](const std::vector<Complex>& z) { return loss(program, z); }, inputs);
  const auto found = gradient(program, inputs);
  for (const Quantity q : {Quantity::position, Quantity::velocity, Quantity::mass, Quantity::compliance,
                           Quantity::damping, Quantity::rest, Quantity::gravity})
    expect_quantity_agrees(scene.layout, q, found, oracle, 1e-9);
}

}  // namespace
}  // namespace sheetbend::testing
