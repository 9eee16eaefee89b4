// Static equilibrium: discrete and continuous closed forms, stability, and starts far away.
#include <gtest/gtest.h>

#include "adjoint/equilibrium/equilibrium_vjp.h"
#include "core/equilibrium/branches.h"
#include "tests/cpp/support/compare.h"
#include "tests/cpp/support/ropes.h"

namespace sheetbend::testing {
namespace {

// O-5d: the polygon of rigid links, exact for the discrete chain.
TEST(Equilibrium, RigidChainIsTheCatenaryPolygon) {
  const struct {
    int links;
    double H, sag;
  } cases[] = {{10, 0.0799083227, 0.3655450363}, {20, 0.0800018257, 0.3634526161}, {40, 0.0800259751, 0.3629487104}};
  for (const auto& c : cases) {
    const Rope rope = make_catenary(c.links, 0.6, 0.2);
    const Equilibrium e = rope.solve();
    ASSERT_TRUE(e.converged) << e.message;
    EXPECT_EQ(e.unstable_modes, 0);
    EXPECT_NEAR(-rope.point(e, c.links / 2).z, c.sag, 1e-9);
    const Vec3<double> link = rope.point(e, 1) - rope.point(e, 0);
    EXPECT_NEAR(-e.lambda[0] * link.x / norm(link), c.H, 1e-9);  // tension is minus lambda
  }
}

// O-8: half a link's mass at the end makes the extension exact.
TEST(Equilibrium, HangingRopeExtendsExactly) {
  for (const double EA : {10.0, 1e4}) {
    Rope rope = make_rope({.links = 20, .EA = EA, .hold_last = false});
    for (int k = 0; k <= 20; ++k) rope.set_position(k, 0.0, 0.0, -k / 20.0);
    const Equilibrium e = rope.solve();
    ASSERT_TRUE(e.converged) << e.message;
    const double extension = 0.05 * g / (2.0 * EA);
    EXPECT_NEAR(-rope.point(e, 20).z - 1.0, extension, 1e-13);
    EXPECT_EQ(e.unstable_modes, 0);
  }
}

// O-15: tip load on an elastica clamped in a wall; a = P L^2 / EI.
TEST(Equilibrium, CantileverWithTipLoadIsTheElastica) {
  const struct {
    double a, drop, shortening;
  } cases[] = {{0.5, 0.16214, 0.01592}, {2.0, 0.49346, 0.16064}, {10.0, 0.81061, 0.55500}};
  for (const auto& c : cases)
    for (const int links : {40, 160}) {
      Rope rope = make_cantilever(links, 0.01, 0.0);
      rope.of(Quantity::force)[5] = -0.01 * c.a;
      const Equilibrium e = rope.solve();
      ASSERT_TRUE(e.converged) << e.message;
      EXPECT_NEAR(-rope.point(e, links).z, c.drop, links == 40 ? 3e-3 : 3e-4)
          << "a = " << c.a << ", " << links << " links";
      EXPECT_NEAR(1.0 - rope.point(e, links).x, c.shortening, links == 40 ? 3e-3 : 3e-4)
          << "a = " << c.a << ", " << links << " links";
      EXPECT_EQ(e.unstable_modes, 0);
    }
}

// O-17: the heavy elastica; gamma = weight per length L^3 / EI.
TEST(Equilibrium, HeavyCantileverIsTheElastica) {
  const struct {
    double gamma, drop, reach;
  } cases[] = {{1.0, 0.12347, 0.99125}, {5.0, 0.49591, 0.84666}, {20.0, 0.82988, 0.44523}, {100.0, 0.93752, 0.15922}};
  for (const auto& c : cases)
    for (const int links : {40, 160}) {
      Rope rope = make_cantilever(links, 0.05 * g / c.gamma, 0.05);
      const Equilibrium e = rope.solve();
      ASSERT_TRUE(e.converged) << e.message;
      EXPECT_NEAR(-rope.point(e, links).z, c.drop, links == 40 ? 3e-3 : 3e-4)
          << "gamma = " << c.gamma << ", " << links << " links";
      EXPECT_NEAR(rope.point(e, links).x, c.reach, links == 40 ? 3e-3 : 3e-4)
          << "gamma = " << c.gamma << ", " << links << " links";
    }
}

// O-21 for the curvature binormal: a couple that closes n links into a polygon is (EI/l) 2 tan(phi/2) / cos^2(phi/2), phi = 2 pi/n.
TEST(Equilibrium, EndCoupleRollsUpTheLinks) {
  for (const int n : {10, 20, 40}) {
    const double EI = 0.01, l = 1.0 / n, phi = 2.0 * std::numbers::pi / n;
    Rope rope =
        make_rope({.links = n, .density = 0.0, .EI = EI, .clamp_first = true, .hold_last = false, .clamp_share = 1.0});
    rope.set_position(-1, -l, 0.0, 0.0);
    Random random(n);
    double x = 0.0, z = 0.0;
    for (int k = 1; k <= n; ++k) {
      const double angle = 1.02 * phi * k;
      x += l * std::cos(angle);
      z += l * std::sin(angle);
      rope.set_position(k, x, 0.0, z);
    }
    const double couple = EI / l * 2.0 * std::tan(phi / 2.0) / (std::cos(phi / 2.0) * std::cos(phi / 2.0));
    rope.of(Quantity::force)[2] = -couple / l;
    rope.of(Quantity::force)[5] = couple / l;
    const Equilibrium e = rope.solve({.stable = false});
    ASSERT_TRUE(e.converged) << e.message;
    EXPECT_NEAR(norm(rope.point(e, n) - rope.point(e, 0)), 0.0, 1e-10) << n;
  }
}

// Without loads a rope with rest curvature takes it: all multipliers vanish, and so does what a relative residual could refer to.
TEST(Equilibrium, UnloadedArcTakesItsRestCurvature) {
  const int n = 12;
  SceneSpec spec;
  spec.particles = n + 1;
  spec.pinned = {0, 1};
  spec.groups = {{"link", "distance", false, {}}, {"bend", "planar_bend", false, {}}};
  for (int k = 1; k < n; ++k) spec.groups[0].stencil.insert(spec.groups[0].stencil.end(), {k, k + 1});
  for (int k = 1; k < n; ++k) spec.groups[1].stencil.insert(spec.groups[1].stencil.end(), {k - 1, k, k + 1});
  const Scene scene = build_scene(spec);
  std::vector<double> inputs(scene.layout.total(), 0.0);
  const Inputs<double> in{scene.layout, inputs.data()};
  const double turn = std::numbers::pi / 12.0;
  for (int k = 0; k <= n; ++k) in.of(Quantity::position)[3 * k] = 0.1 * k;
  for (int k = 0; k < n - 1; ++k) {
    in.of(Quantity::compliance)[k] = 1e-6;
    in.of(Quantity::compliance)[n - 1 + k] = 10.0;
    in.of(Quantity::rest)[k] = 0.1;
    Vec3<double>(0.0, 1.0, 0.0).store(in.of(Quantity::rest) + n - 1 + 4 * k);
    in.of(Quantity::rest)[n - 1 + 4 * k + 3] = 2.0 * std::tan(0.5 * turn);
  }
  const Equilibrium e = EquilibriumSolver(scene).solve(inputs.data());
  ASSERT_TRUE(e.converged) << e.message;
  EXPECT_EQ(e.unstable_modes, 0);
  double x = 0.1, z = 0.0;
  for (int k = 2; k <= n; ++k) {
    x += 0.1 * std::cos((k - 1) * turn);
    z -= 0.1 * std::sin((k - 1) * turn);  // turning about +y takes x towards -z
    EXPECT_NEAR(e.x[3 * k], x, 1e-11);
    EXPECT_NEAR(e.x[3 * k + 2], z, 1e-11);
  }
}

TEST(Equilibrium, TellsStableFromUnstable) {
  const Equilibrium hanging = make_catenary(20, 0.6, 0.36).solve();
  Rope arch = make_catenary(20, 0.6, -0.36);
  for (int k = 0; k <= 20; ++k) arch.set_position(k, hanging.x[3 * k], 0.0, -hanging.x[3 * k + 2]);
  const Equilibrium standing = arch.solve({.stable = false});
  ASSERT_TRUE(hanging.converged && standing.converged) << standing.message;
  EXPECT_EQ(hanging.unstable_modes, 0);
  // 19 free nodes, 57 coordinates less 20 lengths: every motion of the arch that is left lowers it.
  EXPECT_EQ(standing.unstable_modes, 37);
  EXPECT_NEAR(standing.energy, -hanging.energy, 1e-12);

  const Equilibrium fallen = arch.solve();
  ASSERT_TRUE(fallen.converged) << fallen.message;
  EXPECT_EQ(fallen.unstable_modes, 0);
  EXPECT_NEAR(fallen.energy, hanging.energy, 1e-12);
}

// Euler's column, clamped below and free above: P = pi^2 EI / (4 L^2). Above it two sideways directions are unstable.
TEST(Equilibrium, ColumnBucklesAtEulersLoad) {
  for (const double share : {0.98, 1.02}) {
    Rope column =
        make_rope({.links = 40, .density = 0.0, .EA = 1e6, .EI = 0.01, .clamp_first = true, .hold_last = false});
    for (int k = -1; k <= 40; ++k) column.set_position(k, 0.0, 0.0, k / 40.0);
    column.of(Quantity::force)[5] = -share * std::numbers::pi * std::numbers::pi * 0.01 / 4.0;
    const Equilibrium e = column.solve({.stable = false});
    ASSERT_TRUE(e.converged) << e.message;
    EXPECT_EQ(e.unstable_modes, share < 1.0 ? 0 : 2);
  }
}

// The same column from exactly straight, buckled until its free end leans by 60 degrees: the elastica with k = sin(30 degrees), whose load is (2 K / pi)^2 of
// Euler's, whose end is 2 k / K aside and 2 E / K - 1 above (in lengths).
TEST(Equilibrium, ABuckledColumnLeavesItsStraightSaddle) {
  const double k = 0.5, K = std::comp_ellint_1(k), E = std::comp_ellint_2(k);
  Rope column =
      make_rope({.links = 40, .density = 0.0, .EA = 1e6, .EI = 0.01, .clamp_first = true, .hold_last = false});
  for (int n = -1; n <= 40; ++n) column.set_position(n, 0.0, 0.0, n / 40.0);
  column.of(Quantity::force)[5] = -0.01 * K * K;
  const Equilibrium straight = column.solve({.stable = false}), bent = column.solve(), again = column.solve();
  ASSERT_TRUE(straight.converged && bent.converged) << bent.message;
  EXPECT_EQ(straight.unstable_modes, 2);
  EXPECT_LT(bent.energy, straight.energy - 1e-4);
  const Vec3<double> end = column.point(bent, 40);
  EXPECT_NEAR(std::hypot(end.x, end.y), 2.0 * k / K, 5e-3);
  EXPECT_NEAR(end.z, 2.0 * E / K - 1.0, 5e-3);
  EXPECT_EQ(bent.x, again.x);
}

// Clamped at both ends, nearer to each other than it is long, and standing up. It resists sideways only by its weight, so it rolls down about its ends
// until it hangs.
TEST(Equilibrium, AStandingArchRollsDownUntilItHangs) {
  const auto bow = [](double up) {
    Rope rope = make_rope({.links = 40, .EI = 0.02, .clamp_first = true, .clamp_last = true});
    for (int k = -1; k <= 41; ++k) {
      const double s = k / 40.0, held = std::clamp(s, 0.0, 1.0);
      rope.set_position(k, 0.9 * held + (s - held), 0.0, 0.1 * up * (1.0 - std::cos(2.0 * std::numbers::pi * held)));
    }
    return rope;
  };
  const Equilibrium hanging = bow(-1.0).solve(), standing = bow(1.0).solve({.stable = false}),
                    fallen = bow(1.0).solve();
  ASSERT_TRUE(hanging.converged && standing.converged && fallen.converged) << fallen.message;
  EXPECT_EQ(hanging.unstable_modes, 0);
  EXPECT_EQ(standing.unstable_modes, 1);
  EXPECT_EQ(fallen.unstable_modes, 0);
  EXPECT_GT(standing.energy, hanging.energy + 0.05);
  EXPECT_NEAR(fallen.energy, hanging.energy, 1e-9);
  EXPECT_LE(fallen.iterations, 100);
}

// Two springs in compression (von Mises' truss) under a weight just below that at which they snap through. The stable shape is a little above the saddle,
// another one far below. From the saddle the way leads to the near one.
TEST(Equilibrium, FromASaddleTheNearStableShapeIsFound) {
  SceneSpec spec;
  spec.particles = 4;
  spec.pinned = {0, 1, 3};
  spec.groups = {{"bars", "distance", false, {0, 2, 1, 2, 3, 2}}};  // the last one holds it sideways
  const Scene scene = build_scene(spec);
  std::vector<double> inputs(scene.layout.total(), 0.0);
  const Inputs<double> in{scene.layout, inputs.data()};
  const double k = 100.0, rest = std::hypot(1.0, 0.2);
  // Where the force of the bars, 2 k z (rest/length - 1), is largest: length^3 = rest.
  const double length = std::cbrt(rest), top = std::sqrt(length * length - 1.0),
               most = 2.0 * k * top * (rest / length - 1.0);
  Vec3<double>(-1.0, 0.0, 0.0).store(in.of(Quantity::position));
  Vec3<double>(1.0, 0.0, 0.0).store(in.of(Quantity::position) + 3);
  Vec3<double>(0.0, 1e3, 0.0).store(in.of(Quantity::position) + 9);
  in.of(Quantity::rest)[0] = in.of(Quantity::rest)[1] = rest;
  in.of(Quantity::rest)[2] = 1e3;
  std::fill_n(in.of(Quantity::compliance), 3, 1.0 / k);
  in.of(Quantity::gravity)[2] = -g;
  for (const double share : {0.9, 0.99, 0.9999}) {
    in.of(Quantity::mass)[2] = share * most / g;
    const auto from = [&](double z, bool stable) {
      std::vector<double> x(in.of(Quantity::position), in.of(Quantity::position) + scene.dofs());
      x[8] = z;
      return EquilibriumSolver(scene).solve(inputs.data(), x.data(), nullptr, {.stable = stable});
    };
    const double aside = std::sqrt(1.0 - share) * top;
    const Equilibrium above = from(top + aside, true), saddle = from(top - aside, false);
    ASSERT_TRUE(above.converged && saddle.converged);
    ASSERT_EQ(above.unstable_modes, 0) << share;
    ASSERT_EQ(saddle.unstable_modes, 1) << share;
    const Equilibrium left = from(saddle.x[8], true);
    ASSERT_TRUE(left.converged) << left.message;
    EXPECT_EQ(left.unstable_modes, 0);
    EXPECT_NEAR(left.x[8], above.x[8], 1e-8) << share;
  }
}

// From a rough circle hanging down, and from one standing up and slightly bent aside, soft and stiff wires fall into one loop.
TEST(Equilibrium, SoftWireFallsIntoItsLoopFromFarAway) {
  for (const double EI : {1e-5, 6e-5, 1e-3})
    for (const double EA : {1e4, 0.0}) {
      const Rope down = make_wire(EI, EA), up = make_wire(EI, EA, 1.0, 1e-3);
      const Equilibrium loop = down.solve();
      ASSERT_TRUE(loop.converged) << "EI = " << EI << ", EA = " << EA << ": " << loop.message;
      EXPECT_EQ(loop.unstable_modes, 0);
      EXPECT_LE(loop.iterations, 100);
      const Equilibrium fallen = up.solve();
      ASSERT_TRUE(fallen.converged) << "EI = " << EI << ", EA = " << EA << ": " << fallen.message;
      EXPECT_EQ(fallen.unstable_modes, 0);
      EXPECT_NEAR(fallen.energy, loop.energy, 1e-6);
    }
}

TEST(Equilibrium, WarmStartTakesFewIterations) {
  Rope wire = make_wire(6e-5, 1e4);
  EquilibriumSolver solver(wire.scene);
  const Equilibrium first = solver.solve(wire.inputs.data());
  for (int c = wire.links; c < wire.scene.constraints; ++c) wire.of(Quantity::compliance)[c] *= 1.05;
  const Equilibrium next = solver.solve(wire.inputs.data(), first.x.data(), first.lambda.data());
  EXPECT_TRUE(next.converged);
  EXPECT_LE(next.iterations, 4);
}

// Wind that rises from zero: until then a scene in air rests as if there were none.
TEST(Equilibrium, TakesStillAirAndRefusesWind) {
  SceneSpec spec;
  spec.particles = 3;
  spec.pinned = {0};
  spec.groups = {{"links", "distance", false, {0, 1, 1, 2}}};
  spec.air = {{0, 1, 2}};
  spec.wind = {{0.0, 1.0}, Interpolation::linear};
  const Scene scene = build_scene(spec);
  std::vector<double> inputs(scene.layout.total(), 0.0);
  const Inputs<double> in{scene.layout, inputs.data()};
  for (int k = 0; k < 3; ++k) {
    in.of(Quantity::position)[3 * k] = 0.1 * k;
    in.of(Quantity::position)[3 * k + 2] = -k;
    in.of(Quantity::mass)[k] = 1.0;
  }
  in.of(Quantity::rest)[0] = in.of(Quantity::rest)[1] = 1.0;
  in.of(Quantity::gravity)[2] = -g;
  in.of(Quantity::wind)[3] = 2.0;
  in.of(Quantity::air_normal)[0] = 0.7;
  const Equilibrium hanging = EquilibriumSolver(scene).solve(inputs.data());
  EXPECT_TRUE(hanging.converged);
  EXPECT_NEAR(hanging.x[8], -2.0, 1e-9);
  EXPECT_THROW(EquilibriumSolver(scene).solve(inputs.data(), nullptr, nullptr, {.t0 = 0.5}), std::invalid_argument);
}

TEST(Equilibrium, RefusesWhatMayGoSlackAndPressure) {
  SceneSpec spec;
  spec.particles = 3;
  spec.pinned = {0};
  spec.groups = {{"links", "distance", false, {0, 1, 1, 2}}};
  spec.air = {{0, 1, 2}};
  spec.wind.times = {0.0};
  const Scene blown = build_scene(spec);
  std::vector<double> inputs(blown.layout.total(), 1.0);
  std::fill_n(&inputs[blown.layout.of(Quantity::wind)], 3, 0.0);
  EXPECT_THROW(EquilibriumSolver(blown).solve(inputs.data()), std::invalid_argument);
  spec.groups.push_back({"reach", "tether", false, {0, 2}});
  spec.air.clear();
  spec.wind.times.clear();
  const Scene tied = build_scene(spec);
  inputs.assign(tied.layout.total(), 1.0);
  EXPECT_THROW(EquilibriumSolver(tied).solve(inputs.data()), std::invalid_argument);
  EXPECT_THROW(make_plan(tied, {.partition = Partition::direct}), std::invalid_argument);
}

TEST(Equilibrium, SaysSoWhenThereIsNone) {
  SceneSpec spec;
  spec.particles = 3;
  spec.pinned = {0};
  spec.groups = {{"link", "distance", false, {0, 1}}};
  const Scene scene = build_scene(spec);
  std::vector<double> inputs(scene.layout.total(), 0.0);
  const Inputs<double> in{scene.layout, inputs.data()};
  for (int k = 0; k < 3; ++k) {
    in.of(Quantity::position)[3 * k + 2] = -k;
    in.of(Quantity::mass)[k] = 1.0;
  }
  in.of(Quantity::rest)[0] = 1.0;
  in.of(Quantity::gravity)[2] = -g;  // nothing holds particle 2
  const Equilibrium falling = EquilibriumSolver(scene).solve(inputs.data());
  EXPECT_FALSE(falling.converged);
  EXPECT_NE(falling.message.find("Fix:"), std::string::npos);
  EXPECT_THROW(EquilibriumDerivative(scene, inputs.data(), falling), NoEquilibrium);

  const Equilibrium stopped = make_wire(6e-5, 1e4).solve({.max_iterations = 3});
  EXPECT_FALSE(stopped.converged);
  EXPECT_GT(stopped.residual, 1e-6);
}

TEST(Branches, KeepsDistinctShapesByEnergy) {
  const Rope wire = make_wire(1e-3, 1e4);
  const auto start = [](const Rope& r) {
    return std::vector<double>(r.inputs.begin(), r.inputs.begin() + r.scene.dofs());
  };
  const Rope again = make_wire(1e-3, 1e4, -0.9), cut = make_catenary(10, 0.6, 0.2);
  const Branches b = equilibrium_branches(wire.scene, wire.inputs.data(), {start(wire), start(again)});
  EXPECT_EQ(b.found.size(), 1u);
  EXPECT_EQ(b.of_start, (std::vector<int>{0, 0}));
  EXPECT_THROW(equilibrium_branches(wire.scene, wire.inputs.data(), {start(cut)}), std::invalid_argument);
  Rope standing = cut;
  const Equilibrium hanging = cut.solve();
  for (int k = 0; k <= 10; ++k) standing.set_position(k, hanging.x[3 * k], 0.0, -hanging.x[3 * k + 2]);
  const Branches both =
      equilibrium_branches(cut.scene, cut.inputs.data(), {start(standing), start(cut)}, {.stable = false});
  ASSERT_EQ(both.found.size(), 2u);
  EXPECT_EQ(both.of_start, (std::vector<int>{1, 0}));
  EXPECT_LT(both.found[0].energy, both.found[1].energy);
}

}  // namespace
}  // namespace sheetbend::testing
