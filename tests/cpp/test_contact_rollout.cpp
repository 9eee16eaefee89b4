// Contacts in rollouts: closed forms with numbers, gradients against complex steps, and equal bits.
#include <list>
#include <map>

#include "core/rollout/rollout.h"
#include "tests/cpp/support/contact_scenes.h"
#include "tests/cpp/support/lanes.h"

namespace sheetbend::testing {
namespace {

constexpr double g = 9.81;

// A block on a plane that is inclined about the second axis, pressed in as deep as its weight does.
Sample block_on_plane(double slope, double mu, double speed, double h) {
  ContactBuilder b;
  const Vec3<double> n(std::sin(slope), 0.0, std::cos(slope)), along(std::cos(slope), 0.0, -std::sin(slope));
  b.particle(-(g * std::cos(slope) * h * h / rigidity) * n, 0.3, speed * along);
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, slope, 0.0});
  b.contact(mu, 0.0);
  return b.build(g);
}

// h (N v - mu g h N (N + 1)/2) with N = floor(v/(mu g h)): what friction leaves of a speed, step by step.
TEST(Contact, StopsASlidingBlockWhereItShould) {
  for (const auto& [h, expected, slope] : {std::tuple{1e-2, 0.669585, -2.234718}, {1e-3, 0.678579, -2.264737}}) {
    const Sample s = block_on_plane(0.0, 0.3, 2.0, h);
    const Program p{s.scene, make_plan(s.scene, contact_options(h)), static_cast<int>(std::lround(0.8 / h))};
    const auto all = states(p, s.inputs);
    const double* end = &all[p.steps * s.scene.dofs()];
    EXPECT_NEAR(end[0], expected, 1e-6);
    EXPECT_NEAR(end[2], -g * h * h / rigidity, 1e-12);
    std::vector<double> seed(s.scene.dofs());
    seed[0] = 1.0;
    const auto bar = gradient_of_end(p, s.inputs, seed);
    const Inputs<const double> in{s.scene.layout, bar.data()};
    EXPECT_NEAR(in.of(Quantity::friction)[0], slope, 1e-6);
    EXPECT_NEAR(in.of(Quantity::velocity)[0], h * std::floor(2.0 / (0.3 * g * h)), 1e-6);  // h N
  }
}

TEST(Contact, HoldsABlockBelowTheCriticalAngleWithoutCreep) {
  constexpr double h = 1e-3, slope = M_PI / 6.0;
  constexpr int steps = 10000;
  const auto travel = [&](double mu, double* dmu = nullptr) {
    const Sample s = block_on_plane(slope, mu, 0.0, h);
    const Program p{s.scene, make_plan(s.scene, contact_options(h)), steps};
    const auto all = states(p, s.inputs);
    const double* end = &all[steps * s.scene.dofs()];
    std::vector<double> seed(s.scene.dofs());
    seed[0] = std::cos(slope), seed[2] = -std::sin(slope);
    if (dmu) *dmu = gradient_of_end(p, s.inputs, seed)[s.scene.layout.of(Quantity::friction)];
    return end[0] * std::cos(slope) - end[2] * std::sin(slope);
  };
  double dmu;
  EXPECT_LE(std::abs(travel(0.578, &dmu)), 1e-8);
  EXPECT_EQ(dmu, 0.0);
  const double t = steps * h, slides = 0.5 * g * t * t * (std::sin(slope) - 0.577 * std::cos(slope));
  EXPECT_GT(slides, 1e-4);
  EXPECT_NEAR(travel(0.577, &dmu), slides, 0.01 * slides);
  EXPECT_NEAR(dmu, -0.5 * g * t * t * std::cos(slope), 0.01 * g * t * t);
}

// A rope half around a fixed cylinder, one node for every `half turn/nodes` of it, loaded at one end and pulled at the other.
struct Capstan {
  Sample sample;
  int links, pulled;
  double alpha;
};
Capstan capstan(int nodes, double EA, double speed, double time) {
  constexpr double radius = 0.1, density = 0.05;
  constexpr int free_links = 4;
  const double turn = M_PI / nodes, chord = 2.0 * radius * std::sin(0.5 * turn);
  ContactBuilder b;
  std::vector<Vec3<double>> at;
  const auto on = [&](double angle) { return Vec3<double>(-radius * std::cos(angle), 0.0, radius * std::sin(angle)); };
  const Vec3<double> first = on(0.5 * turn), last = on(M_PI - 0.5 * turn);
  for (int k = free_links; k > 0; --k) at.push_back(first - (k * chord) * Vec3<double>(0.0, 0.0, 1.0));
  for (int i = 0; i < nodes; ++i) at.push_back(on((i + 0.5) * turn));
  for (int k = 1; k <= free_links; ++k) at.push_back(last - (k * chord) * Vec3<double>(0.0, 0.0, 1.0));
  for (const auto& x : at) b.particle(x, density * chord);
  const int count = static_cast<int>(at.size());
  const double alpha = chord / EA;
  for (int i = 0; i + 1 < count; ++i) b.constraint("distance", {i, i + 1}, alpha, {chord});
  b.collider("capsule", {radius, 10.0}, {0.0, 0.0, 0.0, M_PI / 2.0, 0.0, 0.0});
  b.spec.driven = {count - 1};
  b.spec.boundary = {{0.0, 0.2 * time, time}, Interpolation::linear};
  b.spec.loaded = {0};
  b.spec.force = {{0.0}, Interpolation::linear};
  b.contact(0.3, 0.0);
  Capstan c{b.build(0.0), count - 1, count - 1, alpha};
  const Inputs<double> in{c.sample.scene.layout, c.sample.inputs.data()};
  in.of(Quantity::force)[2] = -1.0;
  for (int k = 0; k < 3; ++k) {
    at.back().store(in.of(Quantity::boundary) + 3 * k);
    in.of(Quantity::boundary)[3 * k + 2] -= speed * (k == 0 ? 0.0 : k == 1 ? 0.2 * time : time);
  }
  return c;
}

// The tension of link i at a state, and its gradient with respect to that state.
double tension(const Capstan& c, const double* x, int i, double rest, double* seed = nullptr) {
  const Vec3<double> e = Vec3<double>(x + 3 * (i + 1)) - Vec3<double>(x + 3 * i);
  const double length = norm(e);
  if (seed) {
    ((1.0 / (length * c.alpha)) * e).add_to(seed + 3 * (i + 1));
    (-(1.0 / (length * c.alpha)) * e).add_to(seed + 3 * i);
  }
  return (length - rest) / c.alpha;
}

// The ratio is the mean over the last tenth of the time: of the vibration that the pull begins with, substeps of 0.25 ms have damped all but 0.2 % by then.
TEST(Contact, MultipliesARopesTensionAroundACylinder) {
  const auto pull = [&](int nodes, double EA, double speed, double time, double h, double* dmu = nullptr,
                        double* matrices = nullptr) {
    const Capstan c = capstan(nodes, EA, speed, time);
    const Scene& scene = c.sample.scene;
    const double rest = c.sample.inputs[scene.layout.of(Quantity::rest)];
    const Program p{scene, make_plan(scene, contact_options(h)), static_cast<int>(std::lround(time / h))};
    Rollout<double> rollout(scene, p.plan, c.sample.inputs.data());
    double sum = 0.0, ratio = 0.0;
    const int last = std::max(1, p.steps / 10);
    for (int n = 0; n < p.steps; ++n) {
      rollout.advance();
      sum += static_cast<double>(rollout.balance()[0].size());
      if (n < p.steps - last) continue;
      ratio += tension(c, rollout.x(), c.links - 1, rest) / tension(c, rollout.x(), 0, rest) / last;
    }
    if (matrices) *matrices = sum / p.steps;
    EXPECT_NEAR(tension(c, rollout.x(), 0, rest), 1.0, 1e-3);
    std::vector<double> seed(scene.dofs());
    tension(c, rollout.x(), c.links - 1, rest, seed.data());
    if (dmu) *dmu = gradient_of_end(p, c.sample.inputs, seed)[scene.layout.of(Quantity::friction)];
    return ratio;
  };
  double dmu, matrices;
  EXPECT_NEAR(pull(60, 1e4, 0.05, 0.1, 1e-3, &dmu, &matrices), 2.566935, 1e-3);
  EXPECT_NEAR(dmu, 8.0666, 1e-3 * 8.0666);
  EXPECT_LE(matrices, 4.0);
  for (const double h : {4e-3, 2.5e-4}) {
    EXPECT_NEAR(pull(60, 1e4, 0.05, 0.1, h, nullptr, &matrices), 2.566935, 1e-3) << h;
    EXPECT_LE(matrices, 4.0) << h;
  }
  // A soft rope has to be pulled farther until all of it slides.
  for (const double h : {4e-3, 1e-3, 2.5e-4}) {
    EXPECT_NEAR(pull(60, 100.0, 0.02, 1.0, h, nullptr, &matrices), 2.566935, 1e-3) << h;
    EXPECT_LE(matrices, 4.0) << h;
  }
  EXPECT_NEAR(pull(30, 1e4, 0.05, 0.1, 4e-3, nullptr, &matrices), 2.5684, 3e-3);
  EXPECT_LE(matrices, 4.0);
}

// A rope of four particles that falls into a corner of shapes which move and turn: contacts begin, slide, stick and end.
struct Tumble {
  double mu, stiffness;
  Integrator integrator = Integrator::bdf1;
  double restitution = -1.0;
  bool field = false;  // whether the sphere is given by a grid
  double dissipation = -1.0;
  Partition partition = Partition::implicit;

  SolverOptions options() const {
    SolverOptions o = contact_options(1e-3, integrator);
    o.partition = partition;
    if (partition == Partition::gauss_seidel) o.iterations = 6;
    return o;
  }
};
Tumble swept(Tumble t) {
  t.partition = Partition::gauss_seidel;
  return t;
}
Sample tumbling(const Tumble& t, bool joined = true) {
  ContactBuilder b;
  const double link = 0.05;
  for (int i = 0; i < 4; ++i)
    b.particle({link * i, 0.004 * i * i, 0.012 + 0.011 * i}, 0.002 + 0.0003 * i, {0.4 - 0.2 * i, 0.3, -1.0 - 0.1 * i});
  for (int i = 0; joined && i < 3; ++i) b.constraint("distance", {i, i + 1}, link / 50.0, {link});
  for (int i = 0; joined && i < 2; ++i) b.constraint("bend", {i, i + 1, i + 2}, link / 1e-4, {});
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.02, -0.05, 0.3});
  b.collider(t.field ? "distance_field" : "sphere", t.field ? std::vector<double>{} : std::vector<double>{0.05},
             {0.02, 0.02, -0.04, 0.1, 0.2, 0.0, 0.02, 0.02, -0.03, 0.4, 1.2, -0.5}, {0.0, 0.06});
  if (t.field) b.spec.colliders.back().grid = ball_on_grid(0.05, 0.01);
  b.collider("capsule", {0.03, 0.1},
             {0.11, 0.0, -0.015, 1.5, 0.0, 0.0, 0.11, 0.01, -0.025, 1.2, 0.5, 0.0, 0.10, 0.0, -0.01, 1.6, 0.9, 0.1},
             {0.0, 0.03, 0.06});
  b.collider("rounded_box", {0.04, 0.05, 0.02, 0.01}, {0.17, 0.03, -0.012, 0.0, 0.0, 0.5});
  b.contact(t.mu, 0.003, t.stiffness, t.restitution, t.dissipation);
  return b.build(g);
}

// How often contacts of a rollout began, slid, stuck and ended.
struct Modes {
  int began = 0, slid = 0, stuck = 0, ended = 0;
};
Modes modes_of(const Program& p, const std::vector<double>& inputs) {
  Rollout<double> rollout(p.scene, p.plan, inputs.data(), p.t0);
  Plan one_by_one = p.plan;
  one_by_one.contact_groups.clear();  // packs are looked at in the same way
  InverseMasses<double> masses;
  masses.resize(p.scene, p.plan, false);
  std::vector<ColliderPoses<double>> colliders(1);
  std::map<std::pair<int, int>, bool> touching;
  Modes modes;
  std::vector<double> x, x_before;
  for (int n = 0; n < p.steps; ++n) {
    x.assign(rollout.x(), rollout.x() + p.scene.dofs());
    x_before.assign(rollout.state().x_before, rollout.state().x_before + p.scene.dofs());
    rollout.advance();
    const Step<double> step{p.scene,       one_by_one,          {p.scene.layout, inputs.data()},
                            rollout.bdf(), rollout.time(n + 1), {x.data(), x_before.data(), x.data(), x.data(), n}};
    ComputeEffectiveMasses::compute(step, masses);
    contact_source(step, masses, 0).find_poses(colliders[0]);
    for_each_contact(step, masses, colliders, [&](const auto& source, const auto& poses, int c, int i) {
      const Contact& contact = p.scene.contacts[c];
      const auto z = poses.next[contact.collider].in_frame(source.point(contact, i, rollout.x()));
      const auto numbers = source.numbers(poses, c, i);
      const auto at = touch(p.scene.colliders[contact.collider].any(), z, numbers);
      if (!p.scene.colliders[contact.collider].grid) {
        EXPECT_GE(at.normal, 0.0);
        EXPECT_LE(norm(at.tangential), numbers.friction * at.normal * (1.0 + 1e-9));
      }
      bool& before = touching[{c, i}];
      modes.began += at.pushes && !before;
      modes.ended += before && !at.pushes;
      modes.slid += at.pushes && at.slides;
      modes.stuck += at.pushes && !at.slides;
      before = at.pushes;
    });
  }
  return modes;
}

class Tumbling : public ::testing::TestWithParam<Tumble> {
 protected:
  static constexpr int steps = 60;
  // Contacts that bounce are a thousand times stiffer, and rounding with them.
  static double bound() { return GetParam().restitution < 0.0 ? 1e-8 : 1e-6; }
};

TEST_P(Tumbling, HasTheGradientOfComplexSteps) {
  const Sample s = tumbling(GetParam());
  const Program p{s.scene, make_plan(s.scene, GetParam().options()), steps};
  const Modes modes = modes_of(p, s.inputs);
  const bool bounces = GetParam().restitution >= 0.0;  // and slides for a short time only
  EXPECT_GT(modes.began, 3);
  EXPECT_GT(modes.ended, 2);
  EXPECT_GT(modes.slid, bounces ? 0 : 10);
  EXPECT_GT(modes.stuck, GetParam().mu > 0.0 ? 2 : -1);
  const auto of = [&](const std::vector<Complex>& probe) { return loss(p, probe); };
  expect_sums_agree(s.scene.layout, of, s.inputs, gradient(p, s.inputs), bound());
}

TEST_P(Tumbling, HasTheTangentsOfComplexSteps) {
  const Sample s = tumbling(GetParam());
  const Program p{s.scene, make_plan(s.scene, GetParam().options()), steps};
  const Layout& layout = s.scene.layout;
  expect_tangents_agree(p, s.inputs,
                        {layout.of(Quantity::friction) + 1, layout.of(Quantity::collider_pose) + 8,
                         layout.of(GetParam().restitution >= 0.0   ? Quantity::restitution
                                   : GetParam().dissipation >= 0.0 ? Quantity::contact_dissipation
                                                                   : Quantity::collider_size),
                         layout.of(Quantity::velocity)},
                        bound());
}

TEST_P(Tumbling, HasTheSameBitsWhateverKeepsItsStates) {
  const Sample s = tumbling(GetParam());
  const Program p{s.scene, make_plan(s.scene, GetParam().options()), steps};
  expect_bits_of_any_tape(p, s.inputs);

  // Another scene in a lane touches at other times.
  const Layout& layout = s.scene.layout;
  InputsOfLanes inputs(Pack::lanes, s.inputs);
  inputs[3][layout.of(Quantity::gravity) + 2] = -9.5;
  inputs[3][layout.of(Quantity::velocity) + 2] = -0.7;
  for (const int kept : {every_state, Schedule::least(p.steps, Tape<double>::window(p.plan)) + 2})
    expect_bits_of_lanes(p, inputs, {3, 5}, kept);
}

INSTANTIATE_TEST_SUITE_P(
    Contact, Tumbling,
    ::testing::Values(Tumble{0.8, 0.0}, Tumble{0.4, 300.0}, Tumble{0.0, 0.0}, Tumble{0.8, 0.0, Integrator::bdf2},
                      Tumble{0.4, 300.0, Integrator::bdf2}, Tumble{0.4, 0.0, Integrator::bdf1, 0.6},
                      Tumble{0.4, 0.0, Integrator::bdf2, 0.6}, Tumble{0.8, 0.0, Integrator::bdf1, -1.0, true},
                      Tumble{0.4, 0.0, Integrator::bdf2, 0.6, true},
                      Tumble{0.4, 300.0, Integrator::bdf1, -1.0, false, 0.7},
                      Tumble{0.4, 300.0, Integrator::bdf2, -1.0, true, 0.7},
                      Tumble{0.0, 300.0, Integrator::bdf1, -1.0, false, 0.7}, swept({0.8, 0.0}),
                      swept({0.4, 300.0, Integrator::bdf2}), swept({0.4, 0.0, Integrator::bdf2, 0.6, true}),
                      swept({0.4, 300.0, Integrator::bdf1, -1.0, false, 0.7})));

// Restarting from a state in between gives the same bits, also in the middle of an impact.
TEST(Contact, GoesOnFromAnyState) {
  const Sample s = tumbling({0.4, 0.0});
  for (const Integrator integrator : {Integrator::bdf1, Integrator::bdf2}) {
    const Plan plan = make_plan(s.scene, contact_options(1e-3, integrator));
    Rollout<double> whole(s.scene, plan, s.inputs.data());
    std::list<Rollout<double>> others;
    for (int n = 0; n < 30; ++n) {
      whole.advance();
      for (auto& other : others) other.advance();
      if (n < 10) continue;
      others.emplace_back(s.scene, plan, s.inputs.data()).restart(n + 1, whole.state());
    }
    for (const auto& other : others) EXPECT_TRUE(std::equal(whole.x(), whole.x() + s.scene.dofs(), other.x()));
  }
}

// Pressed hard against a small ball, the ball's curvature is a large part of the matrix, and a second pass of the reverse does not stand in for it. Complex
// steps go through the same matrix, so differences tell.
TEST(Contact, HasTheGradientOfDifferencesAroundASmallBall) {
  for (const Integrator integrator : {Integrator::bdf1, Integrator::bdf2}) {
    ContactBuilder b;
    b.particle({0.001, 0.0, 0.0129}, 0.002, {1.0, 0.4, 0.0});
    b.collider("sphere", {0.01}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.001, 0.0, 0.3, 0.0, 0.2}, {0.0, 0.02});
    b.contact(0.2, 0.003);
    const Sample s = b.build(1000.0);
    const Program p{s.scene, make_plan(s.scene, contact_options(1e-3, integrator)), 8};
    EXPECT_GT(modes_of(p, s.inputs).slid, 3);
    const auto found = gradient(p, s.inputs);
    std::vector<double> own, expected, differences;
    for (const Quantity q :
         {Quantity::velocity, Quantity::friction, Quantity::collider_size, Quantity::collider_pose}) {
      std::vector<Complex> probe(s.inputs.begin(), s.inputs.end());
      probe[s.scene.layout.of(q)].im = complex_step;
      expected.push_back(loss(p, probe).im / complex_step);
      own.push_back(found[s.scene.layout.of(q)]);
      double ends[2];
      constexpr double away = 1e-6;
      for (const int side : {0, 1}) {
        std::vector<double> moved = s.inputs;
        moved[s.scene.layout.of(q)] += side ? away : -away;
        ends[side] = loss(p, moved);
      }
      differences.push_back((ends[1] - ends[0]) / (2.0 * away));
    }
    for (std::size_t i = 0; i < own.size(); ++i) {
      EXPECT_NEAR(own[i], expected[i], 1e-9 * std::abs(expected[i])) << i;
      EXPECT_NEAR(own[i], differences[i], 1e-6 + 1e-6 * std::abs(differences[i])) << i;
    }
  }
}

// A cloth that falls over a ball and slides, with springs that are not much stiffer than its inertia.
Sample cloth_on_a_ball(int columns) {
  ContactBuilder b;
  const double apart = 0.01;
  for (int i = 0; i < columns; ++i)
    for (int j = 0; j < columns; ++j)
      b.particle({apart * (i - 0.4 * columns), apart * (j - 0.5 * columns), 0.1}, 1e-3, {0.5, 0.1, -0.3});
  const auto spring = [&](int p, int q, double k) {
    b.constraint("distance", {p, q}, 1.0 / k, {norm(Vec3<double>(&b.x[3 * p]) - Vec3<double>(&b.x[3 * q]))});
  };
  for (int p = 0; p < columns * columns; ++p) {
    const bool right = p % columns + 1 < columns, below = p + columns < columns * columns;
    if (right) spring(p, p + 1, 40.0);
    if (below) spring(p, p + columns, 40.0);
    if (right && below) spring(p, p + columns + 1, 20.0);
  }
  b.collider("sphere", {0.1}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  b.contact(0.3, 0.0, 100.0, -1.0, 20.0);
  return b.build(g);
}

// Newton's steps and the reverse go by iterations there (core/solver/newton_iteration.h), complex steps by a factor.
TEST(Contact, HasTheGradientOfComplexStepsWhereNewtonIterates) {
  const Sample s = cloth_on_a_ball(24);
  const Layout& layout = s.scene.layout;
  Random random(23);
  for (const Integrator integrator : {Integrator::bdf1, Integrator::bdf2}) {
    const Program p = moving_program(s, contact_options(1e-3, integrator), 5);
    EXPECT_GT(modes_of(p, s.inputs).slid, 20);
    const auto found = gradient(p, s.inputs);
    for (int q = 0; q < quantity_count; ++q) {
      std::vector<Complex> probe(s.inputs.begin(), s.inputs.end());
      double along = 0.0, size = 0.0;
      for (std::size_t i = layout.offset[q]; i < layout.offset[q + 1]; ++i) {
        const double direction = random(-1.0, 1.0);
        probe[i].im = complex_step * direction;
        along += direction * found[i];
        size += std::abs(direction * found[i]);
      }
      if (size > 0.0) {
        EXPECT_NEAR(loss(p, probe).im / complex_step, along, 1e-8 * size) << quantity_names[q];
      }
    }
    if (integrator == Integrator::bdf2) expect_bits_of_any_tape(p, s.inputs);
  }
}

// Steps over kinks of friction that are as long as Newton's led round in a circle here, for 95 matrices.
TEST(Contact, LeapsOverKinksWithoutComingBack) {
  constexpr int links = 11;
  constexpr double h = 2e-3, link = 0.3 / links;
  ContactBuilder b;
  for (int i = 0; i <= links; ++i)
    b.particle({link * i, 0.0, 0.0101}, 0.05 * link * (i == 0 || i == links ? 0.5 : 1.0));
  for (int i = 0; i < links; ++i) b.constraint("distance", {i, i + 1}, link / 200.0, {link});
  for (int i = 0; i + 1 < links; ++i) b.constraint("bend", {i, i + 1, i + 2}, link / 1e-4, {});
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.1, 0.0});
  b.contact(0.2, 0.005);
  const Sample s = b.build(g);
  const Plan plan = make_plan(s.scene, contact_options(h));
  Rollout<double> rollout(s.scene, plan, s.inputs.data());
  std::size_t most = 0;
  for (int n = 0; n < 60; ++n) {
    rollout.advance();
    most = std::max(most, rollout.balance()[0].size());
  }
  EXPECT_LE(most, 50u);
}

TEST(Contact, IsRefusedWhereItIsNotMade) {
  const Sample s = tumbling({0.4, 0.0});
  SolverOptions options = contact_options(1e-3);
  for (const Partition other : {Partition::direct, Partition::newton, Partition::newton_cg}) {
    options.partition = other;
    EXPECT_THROW(make_plan(s.scene, options), std::invalid_argument);
  }
  options.partition = Partition::gauss_seidel;
  ContactBuilder b;
  const Vec3<double> none(0.0, 0.0, 0.0);
  b.body(0.1, {1e-4, 1e-4, 1e-4}, {0.0, 0.0, 0.1}, none, none, none);
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  b.contact_of(0, {{0.01, 0.0, 0.0}}, 0.3, 0.0);
  EXPECT_THROW(make_plan(b.build(g).scene, options), std::invalid_argument);
}

// Sweeps project the law that implicit substeps balance. What constraints join differs, since each sweep pushes along the gradient that it meets.
TEST(Contact, OfManySweepsIsThatOfImplicitSubsteps) {
  for (const Tumble& t : {Tumble{0.8, 0.0}, Tumble{0.4, 300.0, Integrator::bdf2}}) {
    const Sample s = tumbling(t, false);
    SolverOptions sweeps = swept(t).options();
    sweeps.iterations = 100;
    constexpr int steps = 40;
    const Program implicit{s.scene, make_plan(s.scene, t.options()), steps};
    const Program many{s.scene, make_plan(s.scene, sweeps), steps};
    EXPECT_GT(modes_of(many, s.inputs).slid, 10);
    const auto expected = states(implicit, s.inputs), found = states(many, s.inputs);
    for (std::size_t d = 0; d < 12; ++d)
      EXPECT_NEAR(found[steps * s.scene.dofs() + d], expected[steps * s.scene.dofs() + d], 1e-9);
  }
}

}  // namespace
}  // namespace sheetbend::testing
