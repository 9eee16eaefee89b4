// Restitution: particles that bounce, against closed forms, and their gradients.
#include "core/rollout/rollout.h"
#include "tests/cpp/support/bounces.h"
#include "tests/cpp/support/lanes.h"

namespace sheetbend::testing {
namespace {

constexpr double g = 9.81;

// Where the first particle ends, and the gradient of direction . end.
struct End {
  Vec3<double> x;
  std::vector<double> bar;
  Layout layout;
  const double* of(Quantity q) const { return bar.data() + layout.of(q); }
};
End fly(const Sample& s, double h, double time, Integrator integrator, const Vec3<double>& direction) {
  const Program p = program(s, h, time, integrator);
  const auto all = states(p, s.inputs);
  std::vector<double> seed(s.scene.dofs());
  direction.store(seed.data());
  return {Vec3<double>(&all[p.steps * s.scene.dofs()]), gradient_of_end(p, s.inputs, seed), s.scene.layout};
}

class Bouncing : public ::testing::TestWithParam<Integrator> {};
INSTANTIATE_TEST_SUITE_P(Bounce, Bouncing, ::testing::Values(Integrator::bdf1, Integrator::bdf2));

// Without gravity, from the height 1 with speed 2 down, radius 0.1: 1.2 after 1 s.
TEST_P(Bouncing, IsExactWithoutGravity) {
  ContactBuilder b;
  b.particle({0.0, 0.0, 1.0}, 0.3, {0.0, 0.0, -2.0});
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  b.contact(0.0, 0.1, 0.0, 1.0);
  const End end = fly(b.build(0.0), 1.0 / 480.0, 1.0, GetParam(), {0.0, 0.0, 1.0});
  EXPECT_NEAR(end.x.z, 1.2, 1e-12);
  EXPECT_NEAR(end.of(Quantity::position)[2], -1.0, 1e-12);
  EXPECT_NEAR(end.of(Quantity::velocity)[2], -1.0, 1e-12);
  EXPECT_NEAR(end.of(Quantity::contact_radius)[0], 2.0, 1e-12);
}

// Dropped from 1 m with e = 0.8: y = e v (T - t) - g (T - t)^2/2 with v = g t, t = sqrt(2 h0/g).
TEST_P(Bouncing, ReachesTheHeightOfItsRestitution) {
  ContactBuilder b;
  b.particle({0.0, 0.0, 1.0}, 0.3);
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  b.contact(0.0, 0.0, 0.0, 0.8);
  const Sample s = b.build(g);
  constexpr double height = 0.5776531, by_height = 0.19055156, by_restitution = 1.10061284;
  std::vector<double> errors[2];
  for (const int rate : {240, 480, 960}) {
    const End end = fly(s, 1.0 / rate, 0.7, GetParam(), {0.0, 0.0, 1.0});
    errors[0].push_back(std::abs(end.x.z - height));
    errors[1].push_back(std::abs(end.of(Quantity::restitution)[0] - by_restitution));
    if (rate == 480) {
      EXPECT_NEAR(end.of(Quantity::position)[2], by_height, 0.05 * by_height);
    }
    if (GetParam() == Integrator::bdf2) {
      EXPECT_NEAR(end.of(Quantity::position)[2], by_height, 1.1e1 / rate / rate);
    }
  }
  const double factor = GetParam() == Integrator::bdf1 ? 2.0 : 4.0;
  for (const auto& e : errors)
    for (int k = 0; k < 2; ++k) EXPECT_NEAR(e[k] / e[k + 1], factor, 0.05 * factor);
}

// Two equal balls of radius 0.1 hit head on without loss: x2 = v0 T + x1 + 0.2. Their distance bounces off a sphere as wide as both, and
// their center goes on.
TEST_P(Bouncing, HandsItsSpeedToAnEqualBall) {
  ContactBuilder b;
  b.particle({-0.52, 0.0, 0.0}, 1.0, {1.0, 0.0, 0.0});  // x1 - x2
  b.collider("sphere", {0.2}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  b.contact(0.0, 0.0, 0.0, 1.0);
  const End end = fly(b.build(0.0), 1.0 / 480.0, 1.0, GetParam(), {-0.5, 0.0, 0.0});
  const double center = 0.26 + 0.5;
  EXPECT_NEAR(center - 0.5 * end.x.x, 1.2, 1e-12);
  EXPECT_NEAR(0.5 + end.of(Quantity::position)[0], 1.0, 1e-12);  // by x1
  EXPECT_NEAR(0.5 - end.of(Quantity::position)[0], 0.0, 1e-12);  // by x2
  EXPECT_NEAR(0.5 + end.of(Quantity::velocity)[0], 1.0, 1e-12);  // by v0
}

// In a square box without loss each coordinate is a triangle wave, after any number of bounces.
TEST_P(Bouncing, UnfoldsInABox) {
  constexpr double time = 5.2, vx = 2.3, vz = 1.7, x0 = 0.3, z0 = 0.4;
  ContactBuilder b;
  b.particle({x0, 0.0, z0}, 1.0, {vx, 0.0, vz});
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  b.collider("plane", {}, {0.0, 0.0, 1.0, M_PI, 0.0, 0.0});
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, M_PI / 2.0, 0.0});
  b.collider("plane", {}, {1.0, 0.0, 0.0, 0.0, -M_PI / 2.0, 0.0});
  b.contact(0.0, 0.0, 0.0, 1.0);
  const Sample s = b.build(0.0);
  const auto unfolded = [](double a, int& bounces) {
    bounces = static_cast<int>(std::floor(a));
    return bounces % 2 == 0 ? a - bounces : 1.0 - (a - bounces);
  };
  int in_x, in_z;
  const double x = unfolded(x0 + vx * time, in_x), z = unfolded(z0 + vz * time, in_z);
  EXPECT_GE(in_x + in_z, 20);
  const End end = fly(s, 1.0 / 480.0, time, GetParam(), {1.0, 0.0, 0.0});
  EXPECT_NEAR(end.x.x, x, 1e-9);
  EXPECT_NEAR(end.x.z, z, 1e-9);
  EXPECT_NEAR(end.of(Quantity::position)[0], in_x % 2 ? -1.0 : 1.0, 1e-9);
  EXPECT_NEAR(end.of(Quantity::velocity)[0], in_x % 2 ? -time : time, 1e-8);
}

// Ground and wall: plain gradient descent on the start's velocity brings the ball to its target.
TEST_P(Bouncing, IsThrownToATargetByItsGradient) {
  double v[2] = {5.0, -5.0}, loss = 0.0;
  for (int step = 0; step <= 800; ++step) {
    ContactBuilder b;
    b.particle({-0.5, 0.0, 1.0}, 1.0, {v[0], 0.0, v[1]});
    b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
    b.collider("plane", {}, {1.75, 0.0, 0.0, 0.0, -M_PI / 2.0, 0.0});
    b.contact(0.1, 0.1, 0.0, 0.92);
    const Sample s = b.build(g);
    const Program p = program(s, 1.0 / 60.0, 0.6, GetParam());
    const auto all = states(p, s.inputs);
    const double *end = &all[p.steps * s.scene.dofs()], away[2] = {end[0] + 2.0, end[2] - 1.5};
    loss = away[0] * away[0] + away[1] * away[1];
    if (loss < 0.005 || step == 800) break;
    std::vector<double> seed(s.scene.dofs());
    seed[0] = 2.0 * away[0], seed[2] = 2.0 * away[1];
    const auto bar = gradient_of_end(p, s.inputs, seed);
    const double* by_v = bar.data() + s.scene.layout.of(Quantity::velocity);
    for (int d = 0; d < 2; ++d) v[d] -= 0.02 * by_v[2 * d];
  }
  EXPECT_LT(loss, 0.005);
}

// Three particles among shapes that move and turn, with one bounce and with several in a substep.
Sample juggled(double e) {
  ContactBuilder b;
  b.particle({0.0, 0.0, 0.05}, 0.3, {0.5, 0.2, -1.5});
  b.particle({0.2, 0.01, 0.08}, 0.2, {0.6, -0.3, -2.0});
  b.particle({0.02, 0.03, 0.04}, 0.1, {-2.5, -0.4, -3.0});
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.05, -0.1, 0.3});
  b.collider("sphere", {0.05}, {0.28, 0.0, 0.0, 0.1, 0.2, 0.0, 0.27, 0.02, 0.03, 0.4, 1.2, -0.5}, {0.0, 0.08});
  b.collider("rounded_box", {0.02, 0.08, 0.08, 0.01},
             {-0.06, 0.0, 0.03, 0.0, 0.1, 0.2, -0.05, 0.0, 0.04, 0.3, 0.2, 0.4}, {0.0, 0.08});
  b.contact(0.2, 0.003, 0.0, e);
  return b.build(g);
}

class Juggling : public ::testing::TestWithParam<Juggle> {};
INSTANTIATE_TEST_SUITE_P(Bounce, Juggling, juggles());

TEST_P(Juggling, HasTheGradientOfComplexSteps) {
  const Sample s = juggled(0.7);
  const Program p = program(s, GetParam().h, 0.08, GetParam().integrator);
  Rollout<double> rollout(s.scene, p.plan, s.inputs.data());
  std::size_t impacts = 0;
  for (int n = 0; n < p.steps; ++n) {
    rollout.advance();
    impacts += rollout.impacts().size();
  }
  EXPECT_GE(impacts, 4u);
  expect_gradient_of_complex_steps(p, s, 3);
}

TEST_P(Juggling, HasTheSameBitsWhateverKeepsItsStates) {
  const Sample s = juggled(0.7);
  const Program p = program(s, GetParam().h, 0.08, GetParam().integrator);
  expect_bits_of_any_tape(p, s.inputs);
  InputsOfLanes inputs(Pack::lanes, s.inputs);
  inputs[3][s.scene.layout.of(Quantity::velocity) + 2] = -0.9;
  expect_bits_of_lanes(p, inputs, {3, 5}, Schedule::least(p.steps, Tape<double>::window(p.plan)));
}

// A slow approach comes to rest, as deep as under its weight.
TEST_P(Bouncing, ComesToRest) {
  ContactBuilder b;
  b.particle({0.0, 0.0, 0.05}, 0.3, {0.4, 0.0, 0.0});
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  b.contact(0.3, 0.0, 0.0, 0.5);
  constexpr double h = 2e-3;
  const Sample s = b.build(g);
  const Program p = program(s, h, 0.8, GetParam());
  const auto all = states(p, s.inputs);
  for (int n = 0; n <= p.steps; ++n) EXPECT_GE(all[n * s.scene.dofs() + 2], -1e-6);
  const double* end = &all[p.steps * s.scene.dofs()];
  EXPECT_NEAR(end[2], -g * h * h / rigidity, 1e-12);
  EXPECT_NEAR(end[0], end[-static_cast<long>(s.scene.dofs())], 1e-12);
}

// Without friction the surface does not know how fast a particle moves along it, also where it does not move at all.
TEST_P(Bouncing, SlipsWithoutFrictionHoweverLittle) {
  for (const double height : {0.3, 0.0})
    for (const double e : {0.8, -1.0}) {
      ContactBuilder b;
      b.particle({0.0, 0.0, height}, 0.3);
      b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
      b.contact(0.0, 0.0, 0.0, e);
      for (const Partition partition : {Partition::implicit, Partition::gauss_seidel}) {
        const Sample s = b.build(g);
        SolverOptions options = contact_options(1.0 / 480.0, GetParam());
        options.partition = partition;
        const Program p{s.scene, make_plan(s.scene, options), 240};
        std::vector<double> seed(s.scene.dofs());
        seed[0] = 1.0;
        const auto bar = gradient_of_end(p, s.inputs, seed);
        EXPECT_NEAR(bar[s.scene.layout.of(Quantity::velocity)], 0.5, 1e-9) << height << " " << e;
        EXPECT_NEAR(bar[s.scene.layout.of(Quantity::position)], 1.0, 1e-9) << height << " " << e;
      }
    }
}

// The time of an impact has its derivative from one step of Newton's method: the rate has to be that of the gap, also where the surface turns.
TEST(Bounce, MeetsATurningSurfaceAtTheRateOfItsGap) {
  Random random(7);
  const auto vector = [&](double size) {
    return size * Vec3<double>(random(-1.0, 1.0), random(-1.0, 1.0), random(-1.0, 1.0));
  };
  for (const bool curved : {false, true})
    for (const auto& [name, sizes] : {std::pair{"plane", std::vector<double>{}},
                                      {"sphere", {0.1}},
                                      {"capsule", {0.1, 0.2}},
                                      {"rounded_box", {0.2, 0.1, 0.15, 0.02}}}) {
      constexpr double h = 0.01, t = 0.004;
      Surface<double> s;
      std::copy(sizes.begin(), sizes.end(), s.size);
      for (Pose<double>* pose : {&s.now, &s.next}) {
        pose->position = vector(0.05);
        turn_by(vector(1.0), pose->turn);
      }
      Flight<double> f{{0.4, 0.3, 0.5}, vector(5.0), {}, vector(5.0), 0.9 * h};
      f.x_end = f.x + (0.5 * f.left) * (f.v + f.v_end);
      const ImpactRule rule{shape_of(name), h, curved};
      Flight<Complex> f_probe;
      Surface<Complex> s_probe;
      std::vector<double> numbers;
      Flight<double>::each(f, [&](double a) { numbers.push_back(a); });
      Surface<double>::each(s, [&](double a) { numbers.push_back(a); });
      std::size_t i = 0;
      Flight<Complex>::each(f_probe, [&](Complex& a) { a = Complex(numbers[i++]); });
      Surface<Complex>::each(s_probe, [&](Complex& a) { a = Complex(numbers[i++]); });
      Complex probe(t);
      probe.im = complex_step;
      const double expected = Approach<Complex>(rule, f_probe, s_probe, probe).gap.im / complex_step;
      EXPECT_NEAR(Approach<double>(rule, f, s, t).rate, expected, 1e-12 * std::abs(expected)) << name << curved;
    }
}

TEST(Bounce, IsRefusedOfWhatIsHeldAndSoft) {
  ContactBuilder b;
  b.particle({0.0, 0.0, 0.1}, 0.1), b.particle({0.1, 0.0, 0.1}, 0.1);
  b.constraint("distance", {0, 1}, 1e-3, {0.1});
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  b.contact(0.3, 0.0, 100.0, 0.5);
  EXPECT_THROW(b.build(g), std::invalid_argument);
}

}  // namespace
}  // namespace sheetbend::testing
