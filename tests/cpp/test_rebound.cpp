// Restitution of what constraints hold: the law by itself, and blocks that bounce.
#include "adjoint/contact/rebound_vjp.h"
#include "core/rollout/rollout.h"
#include "tests/cpp/support/compare.h"
#include "tests/cpp/support/contact_scenes.h"

namespace sheetbend::testing {
namespace {

constexpr double g = 9.81, h = 1e-3;

template <class S>
std::vector<S> flat(const Falling<S>& f) {
  std::vector<S> all;
  Falling<S>::each(f, [&](const S& a) { all.push_back(a); });
  return all;
}

template <class S>
Falling<S> falling(const std::vector<S>& all) {
  Falling<S> f;
  int i = 0;
  Falling<S>::each(f, [&](S& a) { a = all[i++]; });
  return f;
}

// Above a ball that moves and turns, falling on it; `returning`: in the second substep.
Falling<double> above_a_ball(double returning) {
  Falling<double> f{};
  f.x = {0.1, 0.2, 0.78};
  f.v = {0.3, -0.2, -2.0};
  f.gravity = {0.5, 0.0, -g};
  f.mass = 0.3;
  f.surface.friction = 0.4, f.surface.restitution = 0.7, f.surface.radius = 0.0;
  f.surface.size[0] = 0.8;
  for (Pose<double>* pose : {&f.surface.now, &f.surface.next}) {
    const bool later = pose == &f.surface.next;
    pose->position = {0.0, 0.01, later ? -0.0003 : -0.0005};
    turn_by(Vec3<double>(0.2, later ? 0.101 : 0.1, -0.3), pose->turn);
  }
  double at[3], distance, n[3];
  f.surface.now.in_frame(f.x).store(at);
  distance_from(shape_of("sphere"), at, f.surface.size, distance, n);
  f.surface.radius = distance - 0.0007;
  const Vec3<double> normal(n), any(0.3, 0.1, 0.2);
  f.carried = any - dot(any, normal) * normal + returning * normal;
  return f;
}

TEST(Rebound, HasTheDerivativesOfComplexSteps) {
  const int shape = shape_of("sphere");
  const Rebound<double> bar{{0.3, -0.7, 0.5}, 1.3, 0.6e-3};
  for (const double returning : {0.0, 150.0}) {
    const Falling<double> f = above_a_ball(returning);
    const Rebound<double> r = rebound(shape, h, true, f);
    EXPECT_TRUE(r.lifts);
    EXPECT_EQ(r.leaving > 0.0, returning == 0.0);
    EXPECT_FALSE(rebound(shape, h, false, f).lifts);
    const auto expected = complex_step_gradient(
        [&](const std::vector<Complex>& a) {
          const Rebound<Complex> there = rebound(shape, h, true, falling(a));
          return dot(Vec3<Complex>(bar.carried.x, bar.carried.y, bar.carried.z), there.carried) +
                 bar.lift * there.lift + bar.leaving * there.leaving;
        },
        flat(f));
    EXPECT_LE(relative_error(flat(rebound_vjp(shape, h, true, f, bar)), expected), 1e-12) << returning;
  }
}

// A plate of three particles with rigid distances, far above a plane.
Sample plate(double tilt, double mu) {
  ContactBuilder b;
  const Vec3<double> at[] = {{0.0, 0.0, 1.0}, {0.1, 0.0, 1.0 + tilt}, {0.05, 0.08, 1.0}};
  for (const auto& x : at) b.particle(x, 0.1);
  for (const auto& [i, j] : {std::pair{0, 1}, {1, 2}, {0, 2}})
    b.constraint("distance", {i, j}, 0.0, {norm(at[i] - at[j])});
  b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  b.contact(mu, 0.0, 0.0, 0.8);
  return b.build(g);
}

// What falls flat bounces as a particle does: y = e v (T - t) - g (T - t)^2/2 with v = g t, t = sqrt(2 h0/g).
TEST(Rebound, OfAFlatPlateIsThatOfAParticle) {
  constexpr double height = 0.5776531, by_height = 0.19055156;
  for (const auto& [integrator, worst, slope] :
       {std::tuple{Integrator::bdf1, 4e-3, 0.05}, {Integrator::bdf2, 2e-4, 0.01}}) {
    const Sample s = plate(0.0, 0.1);
    const Program p{s.scene, make_plan(s.scene, contact_options(1.0 / 480.0, integrator)), 336};
    const auto all = states(p, s.inputs);
    std::vector<double> seed(s.scene.dofs());
    for (int n = 0; n < 3; ++n) {
      EXPECT_NEAR(all[p.steps * s.scene.dofs() + 3 * n + 2], height, worst);
      seed[3 * n + 2] = 1.0 / 3.0;
    }
    const auto bar = gradient_of_end(p, s.inputs, seed);
    const double* x_bar = bar.data() + s.scene.layout.of(Quantity::position);
    EXPECT_NEAR(x_bar[2] + x_bar[5] + x_bar[8], by_height, slope * by_height);
  }
}

// Edge first, with friction: the next corner meets the plane while the others still leave it.
TEST(Rebound, OfATiltedPlateHasTheGradientOfComplexSteps) {
  for (const Integrator integrator : {Integrator::bdf1, Integrator::bdf2}) {
    const Sample s = plate(0.02, 0.1);
    const Program p{s.scene, make_plan(s.scene, contact_options(1.0 / 480.0, integrator)), 240};
    const auto of = [&](const std::vector<Complex>& probe) { return loss(p, probe); };
    expect_sums_agree(s.scene.layout, of, s.inputs, gradient(p, s.inputs), 1e-8);
  }
}

}  // namespace
}  // namespace sheetbend::testing
