// Bodies: what their axes add to a scene, and oracles of rigid motion.
#include <gtest/gtest.h>

#include "adjoint/rollout/rollout.h"
#include "core/equilibrium/equilibrium.h"
#include "core/scalar/complex.h"
#include "tests/cpp/support/bodies.h"
#include "tests/cpp/support/programs.h"

namespace sheetbend::testing {
namespace {

constexpr std::array<double, 3> box_inertia{0.01083333333333333, 0.00833333333333333,
                                            0.00416666666666667};  // 1 kg, .1 x .2 x .3 m

std::vector<double> run(const Scene& scene, const std::vector<double>& inputs, double h, int steps,
                        int iterations = 2) {
  const Plan plan = make_plan(scene, {.h = h, .partition = Partition::direct, .iterations = iterations});
  std::vector<double> x(scene.dofs());
  rollout_states<double>(scene, plan, inputs.data(), 0.0, {steps}, x.data(), nullptr);
  return x;
}

Vec3<double> at(const Scene& scene, const std::vector<double>& x, int node) {
  return Vec3<double>(&x[scene.first_dof[node]]);
}

// The largest difference between the body's axes and those given.
double attitude_error(const Scene& scene, const std::vector<double>& x, const Body& b,
                      const std::array<Vec3<double>, 3>& exact) {
  double error = 0.0;
  for (int k = 0; k < 3; ++k) {
    const Vec3<double> off = at(scene, x, b.axes[k]) - exact[k];
    error = std::max({error, std::abs(off.x), std::abs(off.y), std::abs(off.z)});
  }
  return error;
}

// R after `time` of a body that turns freely from omega (in its axes): Euler's equations and R' = R [omega], by Runge and Kutta's fourth order.
std::array<Vec3<double>, 3> free_attitude(const std::array<double, 3>& I, const Vec3<double>& omega, double time,
                                          int steps) {
  struct Turn {
    Vec3<double> w, R[3];
    Turn plus(double s, const Turn& d) const {
      return {w + s * d.w, {R[0] + s * d.R[0], R[1] + s * d.R[1], R[2] + s * d.R[2]}};
    }
  };
  const auto rate = [&](const Turn& s) {
    const auto& [a, b, c] = I;
    const Vec3<double>& w = s.w;
    const auto axis = [&](double x, double y, double z) { return x * s.R[0] + y * s.R[1] + z * s.R[2]; };
    return Turn{{(b - c) / a * w.y * w.z, (c - a) / b * w.z * w.x, (a - b) / c * w.x * w.y},
                {axis(0.0, w.z, -w.y), axis(-w.z, 0.0, w.x), axis(w.y, -w.x, 0.0)}};
  };
  Turn s{omega, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const double h = time / steps;
  for (int n = 0; n < steps; ++n) {
    const Turn k1 = rate(s), k2 = rate(s.plus(0.5 * h, k1)), k3 = rate(s.plus(0.5 * h, k2)), k4 = rate(s.plus(h, k3));
    s = s.plus(h / 6.0, k1).plus(h / 3.0, k2).plus(h / 3.0, k3).plus(h / 6.0, k4);
  }
  return {s.R[0], s.R[1], s.R[2]};
}

TEST(FreeBox, TurnsAsEulersEquationsSayToSecondOrder) {
  const Vec3<double> omega(1e-3, 5.0, 1e-3);
  const auto exact = free_attitude(box_inertia, omega, 6.0, 60000);
  EXPECT_NEAR(exact[0].x, 0.6748674, 2e-6);
  EXPECT_NEAR(exact[1].y, -0.9999638, 2e-6);
  EXPECT_NEAR(exact[2].x, -0.7379358, 2e-6);
  BodyScene s;
  s.gravity = {};
  const Body box = s.add_body({}, 1.0, box_inertia, BodyScene::upright(), omega);
  const Scene scene = build_scene(s.spec);
  double before = 0.0;
  for (const auto& [rate, most] : {std::pair{240, 1.75e-2}, {480, 4.15e-3}, {960, 1.05e-3}}) {
    const auto x = run(scene, s.inputs(scene), 1.0 / rate, 6 * rate);
    const double error = attitude_error(scene, x, box, exact);
    record_error(("attitude_" + std::to_string(rate)).c_str(), error);
    EXPECT_LE(error, most);
    if (before > 0.0) {
      EXPECT_NEAR(std::log2(before / error), 2.0, 0.15);
    }
    before = error;
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(dot(at(scene, x, box.axes[j]), at(scene, x, box.axes[k])), j == k ? 1.0 : 0.0, 1e-15);
  }
}

TEST(Body, FallsAsAParticleWithoutTurning) {
  BodyScene s;
  const Body box = s.add_body({}, 1.0, box_inertia, BodyScene::turned(0.3));
  const int particle = s.add_node({}, 1.0);
  const Scene scene = build_scene(s.spec);
  const auto x = run(scene, s.inputs(scene), 0.01, 20);
  EXPECT_NEAR(at(scene, x, box.center).z, at(scene, x, particle).z, 1e-16);
  EXPECT_LE(attitude_error(scene, x, box, BodyScene::turned(0.3)), 1e-15);
}

// A drag kappa on the three axes brakes the turn as 2 kappa about the center: omega falls as exp(-2 kappa t/I).
TEST(Body, DragOnAxesIsTwiceAsMuchAboutTheCenter) {
  constexpr double I = 2e-3, kappa = 1e-3, time = 0.5, omega = 3.0;
  double before = 0.0;
  for (const int steps : {100, 200}) {
    BodyScene s;
    s.spec.has_drag = true;
    const Body ball = s.add_body({}, 0.5, {I, I, I}, BodyScene::upright(), {0, omega, 0});
    const Scene scene = build_scene(s.spec);
    auto inputs = s.inputs(scene);
    for (const int n : ball.axes) inputs[scene.layout.of(Quantity::drag_linear) + n] = kappa;
    const double angle = omega * I / (2 * kappa) * (1.0 - std::exp(-2 * kappa * time / I));
    const double error = attitude_error(scene, run(scene, inputs, time / steps, steps), ball, BodyScene::turned(angle));
    EXPECT_LE(error, 1e-3 * 100 / steps * 100 / steps);
    if (before > 0.0) {
      EXPECT_NEAR(before / error, 4.0, 0.4);
    }
    before = error;
  }
}

// Masses, moments and all else that a body is made from.
TEST(Body, GradientMatchesComplexStep) {
  BodyScene s;
  s.spec.has_drag = true;
  const Body box =
      s.add_body({0.1, 0.0, 0.0}, 1.0, box_inertia, BodyScene::turned(0.4), {0.5, 4.0, -1.0}, {0.3, 0.1, 1.0});
  const Body rod = s.add_body({0.3, 0.1, 0.0}, 0.4, {3e-3, 2e-3, 2.5e-3}, BodyScene::turned(-0.2), {1.0, -2.0, 3.0});
  s.add("distance", {box.center, rod.center}, {0.21});
  s.spec.loaded = {box.axes[0], rod.axes[2], rod.center};
  s.spec.force.times = {0.0, 0.1, 0.3};
  const Scene scene = build_scene(s.spec);
  auto inputs = s.inputs(scene);
  Random random(7);
  const auto fill = [&](Quantity q, double most) {
    for (std::size_t i = 0; i < scene.layout.count(q); ++i) inputs[scene.layout.of(q) + i] = random(0.0, most);
  };
  fill(Quantity::force, 0.02);
  fill(Quantity::drag_linear, 2e-3);
  fill(Quantity::drag_quadratic, 1e-4);
  const Program program{scene, make_plan(scene, {.h = 4e-3, .partition = Partition::direct, .iterations = 2}), 60};
  const auto oracle = complex_step_gradient([&](const std::vector<Complex>& z) { return loss(program, z); }, inputs);
  const auto found = gradient(program, inputs);
  for (const Quantity q : {Quantity::position, Quantity::velocity, Quantity::mass, Quantity::force, Quantity::gravity,
                           Quantity::drag_linear, Quantity::drag_quadratic, Quantity::rest})
    expect_quantity_agrees(scene.layout, q, found, oracle, 1e-10);
}

// A body on a thread, and a torque that grows with its turn: at rest the axes point where the loads pull them.
TEST(Body, ComesToRest) {
  BodyScene s;
  const int hook = s.add_node({}, 1.0);
  const Body box = s.add_body({0.3, 0.1, -0.4}, 1.0, box_inertia, BodyScene::turned(0.4));
  s.add("distance", {hook, box.center}, {0.5}, 1e-3);
  s.spec.pinned = {hook};
  s.spec.loaded = {box.axes[0], box.axes[1]};
  s.spec.force.times = {0.0};
  const Scene scene = build_scene(s.spec);
  auto inputs = s.inputs(scene);
  double* force = &inputs[scene.layout.of(Quantity::force)];
  Vec3<double>(0.0, 2.0, 0.0).store(force);
  Vec3<double>(0.0, 0.0, 1.0).store(force + 3);
  const Equilibrium e = EquilibriumSolver(scene).solve(inputs.data(), nullptr, nullptr, {});
  ASSERT_TRUE(e.converged) << e.message;
  EXPECT_NEAR(at(scene, e.x, box.center).z, -0.5 - 9.81e-3, 1e-12);
  EXPECT_LE(attitude_error(scene, e.x, box, {{{0, 1, 0}, {0, 0, 1}, {1, 0, 0}}}), 1e-9);
}

TEST(Body, IsRefusedWhereItsAxesArePlaces) {
  BodyScene s;
  const Body box = s.add_body({}, 1.0, box_inertia, BodyScene::upright());
  const int a = s.add_node({1, 0, 0}, 1.0), b = s.add_node({0, 1, 0}, 1.0);
  const auto refused = [](const SceneSpec& spec, const std::string& why) {
    try {
      build_scene(spec);
    } catch (const std::invalid_argument& e) {
      return std::string(e.what()).find(why) != std::string::npos;
    }
    return false;
  };
  SceneSpec air = s.spec, twice = s.spec, missing = s.spec;
  air.air = {{a, b, box.axes[1]}};
  air.wind.times = {0.0};
  EXPECT_TRUE(refused(air, "an axis of a body"));
  twice.bodies.push_back({a, {b, box.axes[0], box.axes[1]}});
  EXPECT_TRUE(refused(twice, "in a body already"));
  missing.bodies.push_back({a, {b, 99, 5}});
  EXPECT_TRUE(refused(missing, "does not exist"));
}

}  // namespace
}  // namespace sheetbend::testing
