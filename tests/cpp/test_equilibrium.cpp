// Static equilibrium: discrete and continuous closed forms, stability, starts far away, and the implicit derivative.
#include <gtest/gtest.h>

#include <numbers>

#include "adjoint/equilibrium_vjp.h"
#include "core/equilibrium/branches.h"
#include "tests/cpp/support/compare.h"

namespace sheetbend::testing {
namespace {

constexpr double g = 9.81;

// A rope of n links between particles `first` and `first + n`; with a clamp, the particles before and after them hold its direction.
struct Rope {
  Scene scene;
  std::vector<double> inputs;
  int links, first;

  double* of(Quantity q) { return inputs.data() + scene.layout.of(q); }
  double* position(int k) { return of(Quantity::position) + 3 * (first + k); }
  void set_position(int k, double x, double y, double z) { Vec3<double>(x, y, z).store(position(k)); }
  Equilibrium solve(const EquilibriumOptions& options = {}) const {
    return EquilibriumSolver(scene).solve(inputs.data(), nullptr, nullptr, options);
  }
  Vec3<double> point(const Equilibrium& e, int k) const { return Vec3<double>(&e.x[3 * (first + k)]); }
};

struct RopeShape {
  int links = 10;
  double length = 1.0, density = 0.05, EA = 0.0, EI = 0.0;  // EA = 0: rigid links; EI = 0: no bending
  bool clamp_first = false, clamp_last = false, hold_last = true;
  double clamp_share = 0.5;  // of a link that bends in the clamp's joint
};

Rope make_rope(const RopeShape& s) {
  const int first = s.clamp_first ? 1 : 0, last = first + s.links, particles = last + 1 + (s.clamp_last ? 1 : 0);
  SceneSpec spec;
  spec.particles = particles;
  for (int k = 0; k <= first; ++k) spec.pinned.push_back(k);
  if (s.hold_last)
    for (int k = last; k < particles; ++k) spec.pinned.push_back(k);
  spec.loaded = {last - 1, last};
  spec.force.times = {0.0};
  GroupSpec link{"link", "distance", false, {}}, bend{"bend", "bend", false, {}};
  for (int k = first; k < last; ++k) link.stencil.insert(link.stencil.end(), {k, k + 1});
  for (int k = 1; k + 1 < particles; ++k) bend.stencil.insert(bend.stencil.end(), {k - 1, k, k + 1});
  spec.groups = {link};
  if (s.EI > 0.0) spec.groups.push_back(bend);

  Rope rope{build_scene(spec), {}, s.links, first};
  rope.inputs.assign(rope.scene.layout.total(), 0.0);
  const double l = s.length / s.links;
  for (int k = 0; k <= s.links; ++k) rope.of(Quantity::mass)[first + k] = s.density * l * (k == 0 || k == s.links ? 0.5 : 1.0);
  for (int k = 0; k < s.links; ++k) {
    rope.of(Quantity::rest)[k] = l;
    rope.of(Quantity::compliance)[k] = s.EA > 0.0 ? l / s.EA : 0.0;
  }
  if (s.EI > 0.0)
    for (int c = 0; c < particles - 2; ++c) {
      const bool in_clamp = (s.clamp_first && c == 0) || (s.clamp_last && c == particles - 3);
      rope.of(Quantity::compliance)[s.links + c] = (in_clamp ? s.clamp_share : 1.0) * l / s.EI;
    }
  rope.of(Quantity::gravity)[2] = -g;
  return rope;
}

// Both ends at one height, `span` apart, starting on a parabola above or below them.
Rope make_catenary(int links, double span, double depth, double EA = 0.0) {
  Rope rope = make_rope({.links = links, .EA = EA});
  for (int k = 0; k <= links; ++k) {
    const double s = static_cast<double>(k) / links;
    rope.set_position(k, span * s, 0.0, -4.0 * depth * s * (1.0 - s));
  }
  return rope;
}

// Horizontal along x from its clamp at the origin, free at the other end.
Rope make_cantilever(int links, double EI, double density) {
  Rope rope = make_rope({.links = links, .density = density, .EA = 1e7, .EI = EI, .clamp_first = true, .hold_last = false});
  for (int k = -1; k <= links; ++k) rope.set_position(k, static_cast<double>(k) / links, 0.0, 0.0);
  return rope;
}

// The hanging loop of a soft wire between two holders that point outwards, from a circle on which every link fits only roughly.
Rope make_wire(double EI, double EA, double up = -1.0, double sideways = 0.0) {
  const int n = 200;
  const double length = 1.5, gap = 0.125, radius = length / (2.0 * std::numbers::pi);
  Rope rope = make_rope({.links = n, .length = length, .density = 0.0174, .EA = EA, .EI = EI, .clamp_first = true, .clamp_last = true});
  for (int k = 0; k <= n; ++k) {
    const double s = static_cast<double>(k) / n, turn = 2.0 * std::numbers::pi * s;
    rope.set_position(k, gap * (0.5 - s) + radius * std::sin(turn), sideways * std::sin(turn), up * radius * (1.0 - std::cos(turn)));
  }
  rope.set_position(0, 0.5 * gap, 0.0, 0.0);
  rope.set_position(n, -0.5 * gap, 0.0, 0.0);
  rope.set_position(-1, 0.5 * gap - length / n, 0.0, 0.0);
  rope.set_position(n + 1, -0.5 * gap + length / n, 0.0, 0.0);
  return rope;
}

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
      EXPECT_NEAR(-rope.point(e, links).z, c.drop, links == 40 ? 3e-3 : 3e-4) << "a = " << c.a << ", " << links << " links";
      EXPECT_NEAR(1.0 - rope.point(e, links).x, c.shortening, links == 40 ? 3e-3 : 3e-4) << "a = " << c.a << ", " << links << " links";
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
      EXPECT_NEAR(-rope.point(e, links).z, c.drop, links == 40 ? 3e-3 : 3e-4) << "gamma = " << c.gamma << ", " << links << " links";
      EXPECT_NEAR(rope.point(e, links).x, c.reach, links == 40 ? 3e-3 : 3e-4) << "gamma = " << c.gamma << ", " << links << " links";
    }
}

// O-21 for the curvature binormal: a couple that closes n links into a polygon is (EI/l) 2 tan(phi/2) / cos^2(phi/2), phi = 2 pi/n.
TEST(Equilibrium, EndCoupleRollsUpTheLinks) {
  for (const int n : {10, 20, 40}) {
    const double EI = 0.01, l = 1.0 / n, phi = 2.0 * std::numbers::pi / n;
    Rope rope = make_rope({.links = n, .density = 0.0, .EI = EI, .clamp_first = true, .hold_last = false, .clamp_share = 1.0});
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
    Rope column = make_rope({.links = 40, .density = 0.0, .EA = 1e6, .EI = 0.01, .clamp_first = true, .hold_last = false});
    for (int k = -1; k <= 40; ++k) column.set_position(k, 0.0, 0.0, k / 40.0);
    column.of(Quantity::force)[5] = -share * std::numbers::pi * std::numbers::pi * 0.01 / 4.0;
    const Equilibrium e = column.solve({.stable = false});
    ASSERT_TRUE(e.converged) << e.message;
    EXPECT_EQ(e.unstable_modes, share < 1.0 ? 0 : 2);
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
  const auto start = [](const Rope& r) { return std::vector<double>(r.inputs.begin(), r.inputs.begin() + r.scene.dofs()); };
  const Rope again = make_wire(1e-3, 1e4, -0.9), cut = make_catenary(10, 0.6, 0.2);
  const Branches b = equilibrium_branches(wire.scene, wire.inputs.data(), {start(wire), start(again)});
  EXPECT_EQ(b.found.size(), 1u);
  EXPECT_EQ(b.of_start, (std::vector<int>{0, 0}));
  EXPECT_THROW(equilibrium_branches(wire.scene, wire.inputs.data(), {start(cut)}), std::invalid_argument);
  Rope standing = cut;
  const Equilibrium hanging = cut.solve();
  for (int k = 0; k <= 10; ++k) standing.set_position(k, hanging.x[3 * k], 0.0, -hanging.x[3 * k + 2]);
  const Branches both = equilibrium_branches(cut.scene, cut.inputs.data(), {start(standing), start(cut)}, {.stable = false});
  ASSERT_EQ(both.found.size(), 2u);
  EXPECT_EQ(both.of_start, (std::vector<int>{1, 0}));
  EXPECT_LT(both.found[0].energy, both.found[1].energy);
}

// ---- the implicit derivative ----

struct AtRest {
  Scene scene;
  std::vector<double> inputs;
  Equilibrium rest;
};

AtRest at_rest(Scene scene, std::vector<double> inputs) {
  Equilibrium rest = EquilibriumSolver(scene).solve(inputs.data(), nullptr, nullptr, {.t0 = 0.007});
  EXPECT_TRUE(rest.converged) << rest.message;
  return {std::move(scene), std::move(inputs), std::move(rest)};
}

// A hanging rope with every kind of constraint and every quantity that acts at rest; its last particle is tied to a driven one.
AtRest every_kind() {
  const int n = 10;
  SceneSpec spec;
  spec.particles = n + 2;
  spec.pinned = {0};
  spec.driven = {n + 1};
  spec.loaded = {4, 7};
  spec.boundary.times = {0.0, 0.011, 0.02, 0.05};
  spec.force.times = {0.0, 0.03};
  for_each_kind([&]<class K>(K) {
    GroupSpec group{K::name, K::name, false, {}};
    if constexpr (std::same_as<K, Attachment>)
      group.stencil = {n, n + 1};
    else
      for (int k = 0; k + K::arity <= n + 1; ++k)
        for (int i = 0; i < K::arity; ++i) group.stencil.push_back(k + i);
    spec.groups.push_back(group);
  });
  AtRest s{build_scene(spec), {}, {}};
  s.inputs.assign(s.scene.layout.total(), 0.0);
  const Inputs<double> in{s.scene.layout, s.inputs.data()};
  Random random(11);
  const auto fill = [&](Quantity q, double low, double high) {
    for (std::size_t i = 0; i < s.scene.layout.count(q); ++i) in.of(q)[i] = random(low, high);
  };
  fill(Quantity::mass, 0.01, 0.03);
  fill(Quantity::force, -0.1, 0.1);
  fill(Quantity::gravity, -1.0, 1.0);
  in.of(Quantity::gravity)[2] = -g;
  for (int k = 0; k < n + 2; ++k) {
    const double t = std::min(k, n) / static_cast<double>(n);
    Vec3<double>(0.6 * t, random(-0.01, 0.01), -1.5 * t * (1.0 - t)).store(in.of(Quantity::position) + 3 * k);
  }
  for (std::size_t knot = 0; knot < 4; ++knot)
    Vec3<double>(0.6 + random(-0.01, 0.01), random(-0.01, 0.01), random(-0.01, 0.01)).store(in.of(Quantity::boundary) + 3 * knot);
  for (const Group& group : s.scene.groups)
    for (int i = 0; i < group.count; ++i) {
      double* p = in.of(Quantity::rest) + group.first_value + static_cast<std::size_t>(i) * group.parameters;
      if (group.parameters == 1) *p = random(0.09, 0.11);
      if (group.parameters == 4) {
        Vec3<double>(0.1, 0.99, -0.1).store(p);
        p[3] = random(-0.2, 0.2);
      }
      in.of(Quantity::compliance)[group.first + i] = random(1.0, 2.0) * (group.arity == 2 ? 1e-3 : 1e2);
    }
  return at_rest(std::move(s.scene), std::move(s.inputs));
}

AtRest rigid_catenary() {
  Rope rope = make_catenary(10, 0.6, 0.2);
  Random random(3);
  for (std::size_t i = 0; i < rope.scene.layout.count(Quantity::force); ++i) rope.of(Quantity::force)[i] = random(-0.1, 0.1);
  return at_rest(std::move(rope.scene), std::move(rope.inputs));
}

AtRest soft_wire() {
  Rope wire = make_wire(6e-5, 1e4);
  return at_rest(std::move(wire.scene), std::move(wire.inputs));
}

struct Derivative : ::testing::TestWithParam<AtRest (*)()> {};
INSTANTIATE_TEST_SUITE_P(, Derivative, ::testing::Values(&every_kind, &rigid_catenary, &soft_wire));

// The residual, in complex arithmetic, stays zero along the tangents.
TEST_P(Derivative, TangentsKeepTheResidualZero) {
  const AtRest s = GetParam()();
  Random random(7);
  std::vector<Dual<double, 8>> p(s.inputs.begin(), s.inputs.end()), x(s.scene.dofs()), lambda(s.scene.rows);
  for (std::size_t i = 0; i < p.size(); ++i)
    for (double& d : p[i].d) d = random(-1.0, 1.0) * s.inputs[i];
  const EquilibriumDerivative derivative(s.scene, s.inputs.data(), s.rest);
  derivative.jvp(p.data(), x.data(), lambda.data());
  const auto along = [](const Dual<double, 8>& a, double step) { return Complex(a.v, step * a.d[5]); };
  std::vector<Complex> pc(p.size()), xc(x.size()), lc(lambda.size()), r_x(x.size()), r_l(lambda.size());
  const auto residual = [&](bool with_state) {
    for (std::size_t i = 0; i < p.size(); ++i) pc[i] = along(p[i], complex_step);
    for (std::size_t i = 0; i < x.size(); ++i) xc[i] = along(x[i], with_state ? complex_step : 0.0);
    for (std::size_t i = 0; i < lambda.size(); ++i) lc[i] = along(lambda[i], with_state ? complex_step : 0.0);
    const Inputs<const Complex> in{s.scene.layout, pc.data()};
    place_fixed(s.scene, in, s.rest.t0, xc.data());
    equilibrium_residual(s.scene, in, s.rest.t0, xc.data(), lc.data(), r_x.data(), r_l.data());
    std::pair<double, double> worst;
    for (const Complex& r : r_x) worst.first = std::max(worst.first, std::abs(r.im) / complex_step);
    for (const Complex& r : r_l) worst.second = std::max(worst.second, std::abs(r.im) / complex_step);
    return worst;
  };
  const auto fixed = residual(false), moving = residual(true);
  EXPECT_LE(moving.first, 1e-9 * fixed.first);
  EXPECT_LE(moving.second, 1e-9 * fixed.second);
  record_error("r_x", moving.first / fixed.first);
  record_error("r_l", moving.second / fixed.second);

  std::vector<Complex> x_complex(x.size());
  for (std::size_t i = 0; i < p.size(); ++i) pc[i] = along(p[i], complex_step);
  derivative.jvp(pc.data(), x_complex.data(), static_cast<Complex*>(nullptr));
  std::vector<double> a, b;
  for (std::size_t i = 0; i < x.size(); ++i) a.push_back(x_complex[i].im / complex_step), b.push_back(x[i].d[5]);
  EXPECT_LE(relative_error(a, b), 1e-9);
}

// <x_bar, x_dot> + <lambda_bar, lambda_dot> = <inputs_bar, inputs_dot>, quantity by quantity.
TEST_P(Derivative, CotangentsAreTheTransposeOfTangents) {
  const AtRest s = GetParam()();
  Random random(8);
  const EquilibriumDerivative derivative(s.scene, s.inputs.data(), s.rest);
  std::vector<double> x_bar = random.vector(s.scene.dofs()), lambda_bar = random.vector(s.scene.rows), inputs_bar(s.inputs.size());
  for (int r = 0; r < s.scene.rows; ++r) lambda_bar[r] /= largest(s.rest.lambda);
  derivative.vjp(x_bar.data(), lambda_bar.data(), inputs_bar.data());
  for (int q = 0; q < quantity_count; ++q) {
    std::vector<Dual<double, 1>> p(s.inputs.begin(), s.inputs.end()), x(s.scene.dofs()), lambda(s.scene.rows);
    double by_inputs = 0.0, by_state = 0.0, scale = 0.0;
    for (std::size_t i = s.scene.layout.offset[q]; i < s.scene.layout.offset[q + 1]; ++i) {
      p[i].d[0] = random(-1.0, 1.0) * s.inputs[i];
      by_inputs += p[i].d[0] * inputs_bar[i];
      scale += std::abs(p[i].d[0] * inputs_bar[i]);
    }
    derivative.jvp(p.data(), x.data(), lambda.data());
    for (int i = 0; i < s.scene.dofs(); ++i) by_state += x_bar[i] * x[i].d[0], scale += std::abs(x_bar[i] * x[i].d[0]);
    for (int i = 0; i < s.scene.rows; ++i) by_state += lambda_bar[i] * lambda[i].d[0], scale += std::abs(lambda_bar[i] * lambda[i].d[0]);
    EXPECT_NEAR(by_inputs, by_state, 1e-10 * scale) << quantity_names[q];
    record_error(quantity_names[q], scale > 0.0 ? std::abs(by_inputs - by_state) / scale : 0.0);
  }
}

// Against equilibria solved again at inputs moved to both sides: central differences, Richardson-extrapolated from two steps.
TEST_P(Derivative, MatchesEquilibriaSolvedAgain) {
  const AtRest s = GetParam()();
  EquilibriumSolver solver(s.scene);
  const EquilibriumDerivative derivative(s.scene, s.inputs.data(), s.rest);
  for (const Quantity q : {Quantity::position, Quantity::mass, Quantity::compliance, Quantity::rest, Quantity::boundary, Quantity::force,
                           Quantity::gravity}) {
    Random random(9);
    std::vector<Dual<double, 1>> p(s.inputs.begin(), s.inputs.end()), x(s.scene.dofs()), lambda(s.scene.rows);
    for (std::size_t i = 0; i < s.scene.layout.count(q); ++i) {
      const std::size_t at = s.scene.layout.of(q) + i;
      p[at].d[0] = random(-1.0, 1.0) * (q == Quantity::position ? 0.1 : s.inputs[at]);
    }
    derivative.jvp(p.data(), x.data(), lambda.data());
    const auto moved = [&](double step) {
      std::vector<double> in(s.inputs);
      for (std::size_t i = 0; i < in.size(); ++i) in[i] += step * p[i].d[0];
      const Equilibrium e = solver.solve(in.data(), s.rest.x.data(), s.rest.lambda.data(), {.tolerance = 1e-14, .t0 = s.rest.t0});
      EXPECT_TRUE(e.converged) << e.message;
      return e;
    };
    const double step = 1e-3;
    const Equilibrium a = moved(step), b = moved(-step), c = moved(0.5 * step), d = moved(-0.5 * step);
    const auto difference = [&](const std::vector<double>& a, const std::vector<double>& b, const std::vector<double>& c,
                                const std::vector<double>& d, std::size_t i) {
      return (4.0 * (c[i] - d[i]) / step - (a[i] - b[i]) / (2.0 * step)) / 3.0;
    };
    std::vector<double> x_dot, x_fd, l_dot, l_fd;
    for (std::size_t i = 0; i < x.size(); ++i) x_dot.push_back(x[i].d[0]), x_fd.push_back(difference(a.x, b.x, c.x, d.x, i));
    for (std::size_t i = 0; i < lambda.size(); ++i)
      l_dot.push_back(lambda[i].d[0]), l_fd.push_back(difference(a.lambda, b.lambda, c.lambda, d.lambda, i));
    // A quantity that does not act (no force on the wire, a compliance of zero) leaves nothing but the solver's own rounding.
    const auto expect_equal = [&](const std::vector<double>& found, const std::vector<double>& expected) {
      if (largest(expected) == 0.0)
        EXPECT_LE(largest(found), 1e-10) << quantity_names[static_cast<int>(q)];
      else
        EXPECT_LE(relative_error(found, expected), 1e-7) << quantity_names[static_cast<int>(q)];
    };
    expect_equal(x_fd, x_dot);
    expect_equal(l_fd, l_dot);
    record_error(std::string(quantity_names[static_cast<int>(q)]) + "_x", relative_error(x_fd, x_dot));
  }
}

}  // namespace
}  // namespace sheetbend::testing
