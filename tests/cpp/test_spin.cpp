// Bodies that keep their spin, and loads along rows: oracles of fast turns, and gradients.
#include <gtest/gtest.h>

#include "adjoint/rollout/rollout.h"
#include "core/rollout/rollout.h"
#include "core/scalar/complex.h"
#include "tests/cpp/support/bodies.h"
#include "tests/cpp/support/lanes.h"

namespace sheetbend::testing {
namespace {

Plan direct(const Scene& scene, double h, int iterations = 2, Integrator integrator = Integrator::bdf2) {
  return make_plan(scene, {.h = h, .integrator = integrator, .partition = Partition::direct, .iterations = iterations});
}

Vec3<double> at(const Scene& scene, const double* x, int node) { return Vec3<double>(x + scene.first_dof[node]); }

std::vector<int> both(const Body& a, const Body& b, bool centers) {
  std::vector<int> nodes;
  if (centers) nodes = {a.center, b.center};
  nodes.insert(nodes.end(), a.axes.begin(), a.axes.end());
  nodes.insert(nodes.end(), b.axes.begin(), b.axes.end());
  return nodes;
}

TEST(FreeBox, KeepsItsSpin) {
  const Vec3<double> omega(1e-3, 5.0, 1e-3);
  const std::array<double, 3> I{0.01083333333333333, 0.00833333333333333, 0.00416666666666667};
  constexpr double exact[3][3]{
      {.6748674, .0021918, -.7379358}, {.0075491, -.9999638, .0039339}, {-.7379004, -.0082256, -.6748595}};
  double before = 0.0;
  for (const int rate : {240, 480}) {
    BodyScene s;
    s.gravity = {};
    Body box = s.add_body({}, 1.0, I, BodyScene::upright(), omega);
    s.keep_spin(box);
    const Scene scene = build_scene(s.spec);
    const auto inputs = s.inputs(scene);
    const Plan plan = direct(scene, 1.0 / rate);
    Rollout<double> rollout(scene, plan, inputs.data());
    double size = 0.0, drift = 0.0, error = 0.0;
    rollout.run(6 * rate, [&](int step, const double* x, const double* v) {
      Vec3<double> L;
      for (int k = 0; k < 3; ++k)
        L = L + s.mass[box.axes[k]] * cross(at(scene, x, box.axes[k]), at(scene, v, box.axes[k]));
      if (step == 0) size = norm(L);
      drift = std::max(drift, std::abs(norm(L) / size - 1.0));
    });
    for (int k = 0; k < 3; ++k) {
      const Vec3<double> a = at(scene, rollout.x(), box.axes[k]);
      for (int row = 0; row < 3; ++row)
        error = std::max(error, std::abs((row == 0 ? a.x : row == 1 ? a.y : a.z) - exact[row][k]));
    }
    record_error("attitude_" + std::to_string(rate), error);
    record_error("momentum_" + std::to_string(rate), drift);
    EXPECT_LE(error, rate == 240 ? 3.3e-3 : 9e-4);
    EXPECT_LE(drift, 1e-9);
    if (before > 0.0) {
      EXPECT_NEAR(std::log2(before / error), 2.0, 0.3);
    }
    before = error;
  }
}

struct Top {
  BodyScene s;
  Body disk;
  static constexpr double m = 0.1, R = 0.05, t = 1e-3, l = 0.04, spin = 200.0,
                          tilt = 20.0 * 3.14159265358979323846 / 180, precession = 1.5907643;
};

Top heavy_top(bool keeps_spin) {
  Top top;
  const double I1 = Top::m * (3 * Top::R * Top::R + Top::t * Top::t) / 12, I3 = 0.5 * Top::m * Top::R * Top::R;
  const double c = std::cos(Top::tilt), n = std::sin(Top::tilt);
  const std::array<Vec3<double>, 3> R{{{c, 0, -n}, {0, 1, 0}, {n, 0, c}}};
  const Vec3<double> omega = Vec3<double>(0, 0, Top::precession) + (Top::spin - Top::precession * c) * R[2];
  const int pivot = top.s.add_node({}, 1.0);
  top.s.spec.pinned = {pivot};
  top.disk = top.s.add_body(Top::l * R[2], Top::m, {I1, I1, I3}, R, omega, cross(omega, Top::l * R[2]));
  if (keeps_spin) top.s.keep_spin(top.disk);
  top.s.add("coincide_particle", {top.disk.center, pivot, top.disk.axes[0], top.disk.axes[1], top.disk.axes[2]},
            {0, 0, -Top::l});
  return top;
}

struct Precession {
  double speed, drift;  // over the exact one; of the energy
};

Precession precess(bool keeps_spin) {
  const Top top = heavy_top(keeps_spin);
  const Scene scene = build_scene(top.s.spec);
  const auto inputs = top.s.inputs(scene);
  const Plan plan = direct(scene, 1e-3, 3);
  Rollout<double> rollout(scene, plan, inputs.data());
  double start = 0.0, drift = 0.0, angle = 0.0, last = 0.0;
  constexpr int steps = 2000;
  rollout.run(steps, [&](int step, const double* x, const double* v) {
    // of the body's turn alone: in the first substep, which is BDF1, velocities along the axes are no motion
    const Spin<double> turn(scene, top.disk, top.s.mass.data(), x, v);
    const Vec3<double> velocity = at(scene, v, top.disk.center);
    const double energy = 0.5 * dot(turn.momentum, turn.solve(turn.momentum)) + 0.5 * Top::m * dot(velocity, velocity) +
                          Top::m * 9.81 * at(scene, x, top.disk.center).z;
    const Vec3<double> axis = at(scene, x, top.disk.axes[2]);
    const double now = std::atan2(axis.y, axis.x);
    if (step == 0)
      start = energy;
    else
      angle += std::remainder(now - last, 2 * 3.14159265358979323846);
    last = now;
    drift = std::max(drift, std::abs(energy / start - 1.0));
  });
  return {angle / (steps * 1e-3) / Top::precession, drift};
}

TEST(HeavyTop, PrecessesAndKeepsItsEnergyWithItsSpin) {
  const Precession kept = precess(true), lost = precess(false);
  record_error("precession", kept.speed - 1.0);
  record_error("energy", kept.drift);
  EXPECT_NEAR(kept.speed, 1.0, 2e-4);
  EXPECT_LE(kept.drift, 1e-5);
  EXPECT_GT(std::abs(lost.speed - 1.0), 0.1);
  EXPECT_GT(lost.drift, 0.3);
}

// Hinged bodies that keep their spin, drag, a spring, forces on axes, loads along rows: in every number, against complex step and lane by lane.
struct Everything {
  BodyScene s;
  Scene scene;
  std::vector<double> inputs;
};

Everything everything() {
  BodyScene s;
  s.spec.has_drag = true;
  Body a = s.add_body({0.1, 0, 0}, 0.3, {1e-3, 2e-3, 1.5e-3}, BodyScene::turned(0.3), {2.0, 30.0, 1.0});
  Body b = s.add_body({0.2, 0.1, 0}, 0.2, {2e-3, 1e-3, 1.2e-3}, BodyScene::turned(-0.2), {-1.0, 5.0, 20.0});
  s.keep_spin(a);
  s.keep_spin(b);
  const int dial = s.add_node({0.1, 0, 0}, 1.0), bead = s.add_node({0.3, 0.1, -0.1}, 0.05);
  s.spec.pinned.push_back(dial);
  s.add("coincide", both(a, b, true), {0.06, 0.04, 0.01, -0.05, -0.05, 0.0});
  s.add("across", both(a, b, false), {0, 1, 0, 1, 0, 0}, 1e-2);
  auto turn = both(a, b, false);
  turn.push_back(dial);
  s.add("joint_angle", turn, {1, 0, 0, 0, 0, 1, 1, 0, 0, 0.2}, 5.0, 1e-3);
  s.add("body_particle_distance", {b.center, bead, b.axes[0], b.axes[1], b.axes[2]}, {0.02, 0.01, 0.1, 0.15}, 1e-4);
  s.spec.loaded = {a.axes[1], bead};
  s.spec.force.times = {0.0, 0.1};
  s.spec.loads = {{3, 0, 0}, {1, 0, 2}, {4, 0, 0}};
  s.spec.load = {{0.0, 0.05, 0.2}, Interpolation::linear};
  Everything e{s, build_scene(s.spec), {}};
  e.inputs = s.inputs(e.scene);
  Random random(11);
  const auto fill = [&](Quantity q, double most) {
    for (std::size_t i = 0; i < e.scene.layout.count(q); ++i) e.inputs[e.scene.layout.of(q) + i] = random(0.0, most);
  };
  fill(Quantity::force, 0.05);
  fill(Quantity::load, 0.1);
  fill(Quantity::drag_linear, 2e-3);
  fill(Quantity::drag_quadratic, 1e-4);
  return e;
}

TEST(KeptSpin, GradientMatchesComplexStep) {
  const Everything e = everything();
  const Program program{e.scene, direct(e.scene, 4e-3), 30};
  const auto oracle = complex_step_gradient([&](const std::vector<Complex>& z) { return loss(program, z); }, e.inputs);
  const auto found = gradient(program, e.inputs);
  for (const Quantity q :
       {Quantity::position, Quantity::velocity, Quantity::mass, Quantity::compliance, Quantity::damping, Quantity::rest,
        Quantity::force, Quantity::load, Quantity::gravity, Quantity::drag_linear, Quantity::drag_quadratic})
    expect_quantity_agrees(e.scene.layout, q, found, oracle, 1e-9);
  // a tape that drops states computes them again with the same bits
  auto few = record(program, e.inputs, 6);
  EXPECT_TRUE(same_bits(found, gradient(program, e.inputs, few)));
}

TEST(KeptSpin, HasTheSameBitsInEveryLane) {
  const Everything e = everything();
  const Program program{e.scene, direct(e.scene, 4e-3), 12};
  expect_bits_of_lanes(program, scattered(e.inputs, 3), {0, 5});
}

TEST(KeptSpin, IsRefusedWhereNothingKeepsIt) {
  const Everything e = everything();
  EXPECT_THROW(make_plan(e.scene, {.partition = Partition::gauss_seidel}), std::invalid_argument);
  BodyScene s;
  Body b = s.add_body({}, 1.0, {1.0, 1.0, 1.0}, BodyScene::upright());
  s.keep_spin(b);
  SceneSpec spec = s.spec;
  spec.pinned.clear();
  EXPECT_THROW(build_scene(spec), std::invalid_argument);
  spec = s.spec;
  spec.pinned.push_back(b.axes[0]);
  EXPECT_THROW(build_scene(spec), std::invalid_argument);
}

// A torque along the row of a hinge's angle that has no spring to speak of: the wheel's angle grows as tau t^2/(2 I), with tau falling to zero.
TEST(RowLoad, OnAJointsAngleIsATorque) {
  constexpr double I = 4e-4, tau = 2e-3, time = 0.5;
  double before = 0.0;
  for (const int steps : {60, 120}) {
    BodyScene s;
    s.gravity = {};
    Body still{s.add_node({}, 1.0), {}};
    for (int k = 0; k < 3; ++k) still.axes[k] = s.add_node(BodyScene::upright()[k], 1.0);
    s.spec.pinned = {still.center, still.axes[0], still.axes[1], still.axes[2]};
    s.spec.bodies.push_back(still);
    const Body wheel = s.add_body({}, 0.3, {3e-4, I, 2e-4}, BodyScene::upright());
    const int dial = s.add_node({}, 1.0);
    s.spec.pinned.push_back(dial);
    s.add("coincide", both(still, wheel, true), {0, 0, 0, 0, 0, 0});
    s.add("across", both(still, wheel, false), {0, 1, 0, 1, 0, 0});
    s.add("across", both(still, wheel, false), {0, 1, 0, 0, 0, 1});
    auto turn = both(still, wheel, false);
    turn.push_back(dial);
    s.add("joint_angle", turn, {1, 0, 0, 0, 0, -1, 1, 0, 0, 0}, 1e9);
    s.spec.loads = {{3, 0, 0}};
    s.spec.load = {{0.0, time}, Interpolation::linear};
    const Scene scene = build_scene(s.spec);
    auto inputs = s.inputs(scene);
    inputs[scene.layout.of(Quantity::load)] = tau;
    std::vector<double> x(scene.dofs());
    rollout_states<double>(scene, direct(scene, time / steps), inputs.data(), 0.0, {steps}, x.data(), nullptr);
    const Vec3<double> a = at(scene, x.data(), wheel.axes[0]);
    const double exact = tau * time * time / (3 * I),
                 error = std::abs(std::remainder(std::atan2(-a.z, a.x) - exact, 2 * 3.14159265358979323846));
    EXPECT_LE(error, 2e-2 * exact);
    if (before > 0.0) {
      EXPECT_NEAR(std::log2(before / error), 2.0, 0.4);
    }
    before = error;
  }
}

}  // namespace
}  // namespace sheetbend::testing
