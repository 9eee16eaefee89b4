// The volume of a closed surface: its gradient, what one projection does to it, and what is refused.
#include "core/rollout/rollout.h"
#include "core/scalar/complex.h"
#include "tests/cpp/support/bipyramid.h"

namespace sheetbend::testing {
namespace {

template <class T>
T volume_of(const Scene& scene, const T* x, std::vector<Vec3<T>>& gradient) {
  const Volume& volume = scene.volumes[0];
  std::vector<Vec3<T>> at;
  for (const int n : volume.nodes) at.emplace_back(x + 3 * n);
  gradient.resize(at.size());
  return enclosed(volume, at, gradient);
}

double volume_of(const Scene& scene, const double* x) {
  std::vector<Vec3<double>> gradient;
  return volume_of(scene, x, gradient);
}

constexpr double octahedron = 4.0 / 3.0;

TEST(EnclosedVolume, IsThatOfTheOctahedronWhereverItIs) {
  for (const double far : {0.0, 3.0, -50.0}) {
    const Sample s = bipyramid(4, 0.0, 1.0, {far, -far, 2.0 * far});
    EXPECT_NEAR(volume_of(s.scene, s.inputs.data()), octahedron, 1e-12 * (1.0 + far * far));
  }
}

TEST(EnclosedVolume, GradientMatchesComplexStep) {
  const Sample s = bipyramid(7);
  Random random(1);
  std::vector<double> x(s.inputs.begin(), s.inputs.begin() + s.scene.dofs()), found(x.size());
  for (double& a : x) a += random(-0.2, 0.2);
  std::vector<Vec3<double>> gradient;
  volume_of(s.scene, x.data(), gradient);
  for (std::size_t k = 0; k < gradient.size(); ++k) gradient[k].store(&found[3 * k]);
  const auto oracle = complex_step_gradient(
      [&](const std::vector<Complex>& z) {
        std::vector<Vec3<Complex>> unused;
        return volume_of(s.scene, z.data(), unused);
      },
      x);
  EXPECT_LE(relative_error(found, oracle), 1e-14);
}

// A substep of one projection misses the volume by the second order of what it corrects: a gradient without its 1/6 misses by the first.
double missed(double rest, const Vec3<double>& center) {
  const Sample s = bipyramid(4, 0.0, rest, center);
  const Plan plan = make_plan(s.scene, {.h = 1e-2, .partition = Partition::gauss_seidel, .iterations = 1});
  Rollout<double> rollout(s.scene, plan, s.inputs.data());
  rollout.advance();
  return volume_of(s.scene, rollout.x()) - rest * octahedron;
}

TEST(VolumeProjected, IsKeptToTheSecondOrder) {
  const double whole = missed(1.02, {}), half = missed(1.01, {});
  EXPECT_LT(std::abs(whole), 2e-4);
  EXPECT_NEAR(whole / half, 4.0, 0.1);
}

// Digits do not depend on where the body is.
TEST(VolumeProjected, IsKeptFarFromTheOrigin) { EXPECT_NEAR(missed(1.02, {1e3, 2e3, -1e3}), missed(1.02, {}), 1e-9); }

// With many sweeps lambda = -C eta^2 / alpha: the multiplier is the pressure, here of what is too small by a hundredth.
TEST(VolumeProjected, HasThePressureAsItsMultiplier) {
  const double alpha = 1e-3, h = 1e-3;
  const Sample s = bipyramid(4, alpha, 1.01);
  const Plan plan = make_plan(
      s.scene, {.h = h, .integrator = Integrator::bdf1, .partition = Partition::gauss_seidel, .iterations = 20});
  Rollout<double> rollout(s.scene, plan, s.inputs.data());
  rollout.advance();
  const double pressure = rollout.multipliers()[s.scene.rows] / (h * h);
  EXPECT_GT(pressure, 0.0);
  EXPECT_NEAR(pressure, (1.01 * octahedron - volume_of(s.scene, rollout.x())) / alpha, 1e-9 * pressure);
}

TEST(VolumeProjected, LeavesPinnedParticlesInPlace) {
  const Sample s = bipyramid(4, 0.0, 1.2, {}, {0, 4});
  const Plan plan = make_plan(s.scene, {.h = 1e-2, .partition = Partition::gauss_seidel, .iterations = 30});
  Rollout<double> rollout(s.scene, plan, s.inputs.data());
  rollout.advance();
  for (const int n : {0, 4})
    for (int d = 0; d < 3; ++d) EXPECT_EQ(rollout.x()[3 * n + d], s.inputs[3 * n + d]);
  EXPECT_NEAR(volume_of(s.scene, rollout.x()), 1.2 * octahedron, 1e-12);
}

TEST(SceneWithVolume, NamesWhatIsWrong) {
  using Triangles = std::vector<std::array<int, 3>>;
  const Triangles closed{{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
  const auto build = [](const Triangles& triangles, const std::vector<int>& pinned = {}) {
    SceneSpec spec;
    spec.particles = 6;
    spec.directors = {{5, 0, 1}};
    spec.pinned = pinned;
    spec.volumes = {{"body", triangles}};
    return build_scene(spec);
  };
  EXPECT_NO_THROW(build(closed));
  EXPECT_NO_THROW(build(closed, {0, 1, 2}));
  EXPECT_THROW(build(closed, {0, 1, 2, 3}), std::invalid_argument);
  EXPECT_THROW(build({}), std::invalid_argument);
  EXPECT_THROW(build({{0, 1, 7}}), std::invalid_argument);
  EXPECT_THROW(build({{0, 1, 1}}), std::invalid_argument);
  Triangles open = closed, turned = closed, director = closed;
  open.pop_back();
  std::swap(turned[0][0], turned[0][1]);
  for (auto& t : director)
    for (int& n : t) n = n == 3 ? 5 : n;
  for (const Triangles& bad : {open, turned, director}) EXPECT_THROW(build(bad), std::invalid_argument);
}

// Blocks are made of constraints.
TEST(SceneWithVolume, OfLooseParticlesTakesSweepsAlone) {
  const Sample s = bipyramid(4);
  for (const Partition partition : {Partition::direct, Partition::newton, Partition::newton_cg, Partition::implicit})
    EXPECT_THROW(make_plan(s.scene, {.partition = partition}), std::invalid_argument);
}

}  // namespace
}  // namespace sheetbend::testing
