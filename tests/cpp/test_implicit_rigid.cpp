// Rigid rows in implicit blocks: a cube of nine particles that falls on a plane, slides and comes to rest; its gradients against complex steps; rows that
// others say already; a pendulum; and equal bits.
#include <map>

#include "core/rollout/redundant_rows.h"
#include "core/rollout/rollout.h"
#include "tests/cpp/support/contact_scenes.h"
#include "tests/cpp/support/lanes.h"

namespace sheetbend::testing {
namespace {

constexpr double g = 9.81, edge = 0.1, mass = 0.04;

// Corners as binary numbers, and the center. `all`: every pair, of which 21 are enough.
Sample cube(bool all, double mu, const Vec3<double>& at, const Vec3<double>& turn, const Vec3<double>& v,
            const Vec3<double>& omega, bool carried = false) {
  ContactBuilder b;
  double R[9];
  turn_by(turn, R);
  std::vector<Vec3<double>> x;
  for (int k = 0; k < 9; ++k) {
    const double c[3] = {k == 8 ? 0.0 : (k & 1) - 0.5, k == 8 ? 0.0 : (k >> 1 & 1) - 0.5,
                         k == 8 ? 0.0 : (k >> 2) - 0.5};
    double r[3];
    for (int d = 0; d < 3; ++d) r[d] = edge * (R[3 * d] * c[0] + R[3 * d + 1] * c[1] + R[3 * d + 2] * c[2]);
    x.push_back(at + Vec3<double>(r));
    b.particle(x.back(), k == 8 ? 0.05 : mass + 0.002 * k, v + cross(omega, Vec3<double>(r)));
  }
  std::vector<std::pair<int, int>> pairs{{0, 1}, {0, 2}, {1, 2}, {0, 4}, {1, 4}, {2, 4}};
  for (const int k : {3, 5, 6, 7, 8})
    for (const int to : {1, 2, 4}) pairs.emplace_back(to, k);
  if (all) {
    pairs.clear();
    for (int i = 0; i < 9; ++i)
      for (int k = 0; k < i; ++k) pairs.emplace_back(k, i);
  }
  for (const auto& [i, k] : pairs) b.constraint("distance", {i, k}, 0.0, {norm(x[i] - x[k])});
  if (carried) {  // a soft rope on one of its corners
    const int end = b.particle(x[7] + Vec3<double>(0.05, 0.0, 0.02), 0.01, v);
    b.constraint("distance", {7, end}, 0.05 / 200.0, {0.05});
  }
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  b.contact(mu, 0.0);
  return b.build(g);
}

Sample tossed(bool all = false, double mu = 0.2, bool carried = false) {
  return cube(all, mu, {0.0, 0.0, 0.12}, {0.5, 0.3, 0.2}, {0.8, 0.1, -0.5}, {1.0, -3.0, 2.0}, carried);
}

double longest_error(const Sample& s, const double* x) {
  const Group& links = s.scene.groups[0];
  double error = 0.0;
  for (int k = 0; k < links.count; ++k) {
    const auto n = links.nodes(k);
    const double rest = s.inputs[s.scene.layout.of(Quantity::rest) + k];
    if (s.inputs[s.scene.layout.of(Quantity::compliance) + k] == 0.0)
      error = std::max(error, std::abs(norm(Vec3<double>(x + 3 * n[0]) - Vec3<double>(x + 3 * n[1])) - rest));
  }
  return error;
}

// What every substep has to show: nothing pulls, friction stays in its cone, rows hold. Returns the deepest penetration.
double check_contacts(const Sample& s, const double* x, double h, double mu) {
  const Contact& contact = s.scene.contacts[0];
  double deepest = 0.0;
  for (int i = 0; i < contact.points(); ++i) {
    const int n = contact.first_node(i);
    const double depth = std::max(0.0, -x[3 * n + 2]);
    const double* f = x + 3 * contact.carried[i];
    const double normal = rigidity * s.inputs[s.scene.layout.of(Quantity::mass) + n] * depth / (h * h);
    EXPECT_LE(std::hypot(f[0], f[1], f[2]), mu * normal * (1.0 + 1e-9) + 1e-15);
    deepest = std::max(deepest, depth);
  }
  EXPECT_LE(longest_error(s, x), 1e-12);
  return deepest;
}

TEST(RigidCube, FallsSlidesAndComesToRest) {
  constexpr double h = 1e-3, mu = 0.2;
  const Sample s = tossed();
  const Plan plan = make_plan(s.scene, contact_options(h));
  Rollout<double> rollout(s.scene, plan, s.inputs.data());
  std::vector<double> before;
  double deepest = 0.0, matrices = 0.0;
  constexpr int steps = 900;
  for (int n = 0; n < steps; ++n) {
    if (n == steps - 100) before.assign(rollout.x(), rollout.x() + 27);
    rollout.advance();
    const double deep = check_contacts(s, rollout.x(), h, mu);
    deepest = std::max(deepest, deep);
    matrices += static_cast<double>(rollout.balance()[0].size());
    if (n == steps - 1) {
      EXPECT_LE(deep, 1e-6);
    }
  }
  EXPECT_LE(matrices / steps, 6.0);
  EXPECT_LE(deepest, 5e-4);
  for (int i = 0; i < 27; ++i) EXPECT_NEAR(rollout.x()[i], before[i], 1e-9);
  // It lies on a face, and on the supports' forces.
  EXPECT_NEAR(rollout.x()[26], 0.5 * edge, 1e-6);
}

struct RigidTumble : ::testing::TestWithParam<std::tuple<bool, double, bool>> {
  Sample sample = tossed(std::get<0>(GetParam()), std::get<1>(GetParam()), std::get<2>(GetParam()));
  // Forces that contacts carry are as stiff as those, and would drown all else: the loss counts the cube alone.
  Program program{sample.scene, make_plan(sample.scene, contact_options(2e-3)), 45, 0.0, 27};
};
INSTANTIATE_TEST_SUITE_P(RigidCube, RigidTumble,
                         ::testing::Values(std::tuple{false, 0.2, false}, std::tuple{true, 0.2, false},
                                           std::tuple{false, 0.0, true}, std::tuple{false, 0.5, true}));

TEST_P(RigidTumble, HasTheGradientOfComplexSteps) {
  const auto of = [&](const std::vector<Complex>& probe) { return loss(program, probe); };
  expect_sums_agree(sample.scene.layout, of, sample.inputs, gradient(program, sample.inputs), 1e-9);  // of many entries
}

TEST_P(RigidTumble, HasTheGradientOfDifferences) {
  const auto bar = gradient(program, sample.inputs);
  Random random(3);
  std::vector<double> v(sample.inputs.size());
  const Layout& layout = sample.scene.layout;
  for (const Quantity q : {Quantity::velocity, Quantity::mass, Quantity::gravity, Quantity::friction})
    for (std::size_t i = 0; i < layout.count(q); ++i)
      v[layout.of(q) + i] = random(-1.0, 1.0) * (q == Quantity::mass ? 0.01 : 1.0);
  const auto moved = [&](double size) {
    std::vector<double> in = sample.inputs;
    for (std::size_t i = 0; i < in.size(); ++i) in[i] += size * v[i];
    return loss(program, in);
  };
  constexpr double step = 1e-5;
  const double slope = (moved(step) - moved(-step)) / (2.0 * step);
  EXPECT_NEAR(std::inner_product(bar.begin(), bar.end(), v.begin(), 0.0), slope, 1e-6 * std::abs(slope));
}

TEST_P(RigidTumble, HasTheTangentsOfComplexSteps) {
  using D = Dual<double, 4>;
  const Layout& layout = sample.scene.layout;
  std::vector<D> inputs(sample.inputs.begin(), sample.inputs.end());
  const std::size_t along[] = {layout.of(Quantity::friction), layout.of(Quantity::mass) + 3,
                               layout.of(Quantity::rest) + 2, layout.of(Quantity::velocity)};
  for (int d = 0; d < 4; ++d) inputs[along[d]].d[d] = 1.0;
  Rollout<D> rollout(sample.scene, program.plan, inputs.data());
  for (int n = 0; n < program.steps; ++n) rollout.advance();
  const int rows = sample.scene.multipliers();
  for (int d = 0; d < 4; ++d) {
    std::vector<Complex> probe(sample.inputs.begin(), sample.inputs.end());
    probe[along[d]].im = complex_step;
    Rollout<Complex> near(sample.scene, program.plan, probe.data());
    for (int n = 0; n < program.steps; ++n) near.advance();
    std::vector<double> found, expected, forces, expected_forces;
    for (int i = 0; i < 27; ++i) {
      expected.push_back(near.x()[i].im / complex_step);
      found.push_back(rollout.x()[i].d[d]);
    }
    for (int i = 0; i < rows; ++i) {
      expected_forces.push_back(near.multipliers()[i].im / complex_step);
      forces.push_back(rollout.multipliers()[i].d[d]);
    }
    EXPECT_LE(relative_error(found, expected), 1e-10) << d;
    EXPECT_LE(relative_error(forces, expected_forces), 1e-8) << d;
  }
}

TEST_P(RigidTumble, HasTheSameBitsWhateverKeepsItsStates) {
  expect_bits_of_any_tape(program, sample.inputs);
  InputsOfLanes inputs(Pack::lanes, sample.inputs);
  inputs[3][sample.scene.layout.of(Quantity::gravity) + 2] = -9.5;
  inputs[4][sample.scene.layout.of(Quantity::compliance)] = 1e-4;  // gives way in this scene alone
  expect_bits_of_lanes(program, inputs, {3, 4, 5});
}

// A rigid rope that slides off a ball, of links whose compliance is next to nothing, or nothing: the same motion, and many rows.
TEST(RigidRope, SlidesOffABall) {
  const auto end = [](double compliance) {
    ContactBuilder b;
    constexpr int links = 30;
    constexpr double link = 0.02;
    for (int i = 0; i <= links; ++i) b.particle({link * (i - 9), 0.004 * std::sin(i), 0.2 + 1e-3}, 0.001);
    for (int i = 0; i < links; ++i) {
      const double y = 0.004 * (std::sin(i + 1) - std::sin(i));
      b.constraint("distance", {i, i + 1}, compliance, {std::hypot(link, y)});
    }
    b.collider("sphere", {0.2}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
    b.contact(0.2, 0.0);
    const Sample s = b.build(g);
    const Plan plan = make_plan(s.scene, contact_options(1e-3));
    Rollout<double> rollout(s.scene, plan, s.inputs.data());
    double matrices = 0.0;
    for (int n = 0; n < 300; ++n) {
      rollout.advance();
      matrices += static_cast<double>(rollout.balance()[0].size());
    }
    EXPECT_LE(matrices / 300, 8.0);
    if (compliance == 0.0) {
      EXPECT_LE(longest_error(s, rollout.x()), 1e-12);
    }
    return std::vector<double>(rollout.x(), rollout.x() + 3 * (links + 1));
  };
  const auto rigid = end(0.0), stiff = end(1e-14);
  EXPECT_LE(rigid[3 * 30 + 2], -0.05);
  for (std::size_t i = 0; i < rigid.size(); ++i) EXPECT_NEAR(rigid[i], stiff[i], 1e-7);
}

// Every pair moves as the 21 that are enough, and the other 15 are named.
TEST(RigidCube, LeavesOutTheRowsThatFollow) {
  const Sample few = tossed(false), all = tossed(true);
  const auto at = [](const Sample& s) {
    return states(Program{s.scene, make_plan(s.scene, contact_options(1e-3)), 200}, s.inputs);
  };
  const auto x = at(few), y = at(all);
  for (int i = 0; i < 27; ++i)
    EXPECT_NEAR(x[x.size() - few.scene.dofs() + i], y[y.size() - all.scene.dofs() + i], 1e-9);
  const Plan plan = make_plan(all.scene, contact_options(1e-3));
  const auto redundant = redundant_rows(all.scene, plan, all.inputs.data(), 0.0);
  ASSERT_EQ(redundant.size(), 15u);
  for (const RedundantRow& row : redundant) {
    EXPECT_GE(row.others.size(), 2u);  // the halves of a diagonal
    EXPECT_LE(row.contradiction, 1e-14);
  }
  EXPECT_NE(
      describe(all.scene, redundant, all.inputs.data() + all.scene.layout.of(Quantity::position)).find("follows from"),
      std::string::npos);
  EXPECT_TRUE(redundant_rows(few.scene, make_plan(few.scene, contact_options(1e-3)), few.inputs.data(), 0.0).empty());
}

// A weight on a rigid link, and a second one on that: the end of the first substep after rest, and a full swing.
Sample pendulum(double angle) {
  SceneSpec spec;
  spec.particles = 2;
  spec.pinned = {0};
  spec.groups = {{"links", "distance", false, {0, 1}}};
  Sample s{build_scene(spec), {}};
  s.inputs.resize(s.scene.layout.total());
  const Inputs<double> in{s.scene.layout, s.inputs.data()};
  Vec3<double>(std::sin(angle), 0.0, -std::cos(angle)).store(in.of(Quantity::position) + 3);
  std::fill_n(in.of(Quantity::mass), 2, 2.0);
  in.of(Quantity::rest)[0] = 1.0;
  in.of(Quantity::gravity)[2] = -g;
  return s;
}

TEST(RigidPendulum, SwingsAsItShould) {
  constexpr double angle = 1.2;
  double a = 1.0, c = std::cos(0.5 * angle);
  for (int k = 0; k < 8; ++k) std::tie(a, c) = std::pair{0.5 * (a + c), std::sqrt(a * c)};
  const double quarter = M_PI / (2.0 * a) / std::sqrt(g);  // of the period
  const Sample s = pendulum(angle);
  double errors[2];
  for (int k = 0; k < 2; ++k) {
    const int steps = 250 << k;
    const double h = quarter / steps;
    const Plan plan = make_plan(s.scene, {.h = h, .partition = Partition::implicit, .iterations = 50});
    Rollout<double> rollout(s.scene, plan, s.inputs.data());
    for (int n = 0; n < steps; ++n) rollout.advance();
    const double* x = rollout.x() + 3;
    EXPECT_NEAR(std::hypot(x[0], x[2]), 1.0, 1e-14);
    errors[k] = std::abs(std::atan2(x[0], -x[2]));
    // At the bottom the link carries m g (3 - 2 cos(angle)).
    const double tension = -rollout.multipliers()[0] / (4.0 / 9.0 * h * h);
    EXPECT_NEAR(tension, 2.0 * g * (3.0 - 2.0 * std::cos(angle)), 2e-3 * tension);
  }
  EXPECT_LE(errors[0], 1e-4);
  EXPECT_LE(errors[1], 0.3 * errors[0]);  // second order
}

}  // namespace
}  // namespace sheetbend::testing
