// Rods with frames in implicit blocks: their directors at the balance, contact and friction of their particles, and gradients against complex steps.
#include "core/rollout/rollout.h"
#include "tests/cpp/support/contact_scenes.h"
#include "tests/cpp/support/lanes.h"

namespace sheetbend::testing {
namespace {

constexpr double g = 9.81, length = 0.3, density = 0.05, EI = 1e-4, GJ = 0.8e-4;
constexpr int links = 6;

struct Laid {
  double mu = 0.2, EA = 200.0;
  bool ball = false, held = false;         // a ball instead of a plane; its first particle and director stand
  double restitution = -1.0, above = 0.0;  // far above it touches nothing
};

// A rod that is bent and twisted at rest, thrown onto a shape.
Sample laid(const Laid& how) {
  ContactBuilder b;
  std::vector<Vec3<double>> at;
  for (int k = 0; k <= links; ++k) {
    const double s = length * k / links;
    at.push_back({s, 0.02 * std::sin(9.0 * s), how.above + 0.009 + 0.004 * std::cos(11.0 * s)});
  }
  const int rod = b.rod(at, density, how.EA, EI, GJ, {0.1, 1.0, 0.3}, {0.8, 0.3, -0.4});
  b.spec.groups[0].damped = b.spec.groups[2].damped = true;
  const double bent = how.held ? 0.1 : 0.0;  // a free one would roll at once to where it bends by itself
  for (std::size_t i = 0; i < b.rests["material_curvature"].size(); i += 3)
    b.rests["material_curvature"][i + 1] = bent, b.rests["material_curvature"][i + 2] = -0.4 * bent;
  for (double& twist : b.rests["twist"]) twist = 0.3;
  if (how.held) b.spec.pinned = {rod, rod + links + 1};
  if (how.ball)
    b.collider("sphere", {0.5}, {0.1, 0.0, -0.5, 0.0, 0.0, 0.0});
  else
    b.collider("plane", {}, {0.0, 0.0, 0.0, 0.0, 0.02, 0.0});
  b.contact(how.mu, 0.004, 0.0, how.restitution);
  Sample s = b.build(g);
  const Inputs<double> in{s.scene.layout, s.inputs.data()};
  std::fill_n(in.of(Quantity::damping), s.scene.layout.count(Quantity::damping), 2e-3);
  return s;
}

struct LaidRod : ::testing::TestWithParam<std::tuple<Laid, Integrator>> {
  Sample sample = laid(std::get<0>(GetParam()));
  Program program = moving_program(sample, contact_options(2e-3, std::get<1>(GetParam())), 25);
};
INSTANTIATE_TEST_SUITE_P(Rods, LaidRod,
                         ::testing::Values(std::tuple{Laid{}, Integrator::bdf1}, std::tuple{Laid{}, Integrator::bdf2},
                                           std::tuple{Laid{.mu = 0.5, .ball = true, .held = true}, Integrator::bdf2},
                                           std::tuple{Laid{.mu = 0.0, .ball = true}, Integrator::bdf1},
                                           std::tuple{Laid{.mu = 0.3, .EA = 0.0}, Integrator::bdf1},
                                           std::tuple{Laid{.mu = 0.3, .EA = 0.0, .held = true}, Integrator::bdf2},
                                           std::tuple{Laid{.above = 1.0}, Integrator::bdf1},
                                           std::tuple{Laid{.held = true, .above = 1.0}, Integrator::bdf2}));

TEST_P(LaidRod, HasTheGradientOfComplexStepsWhereItTouchesAndWhereNot) {
  const int touching = times_touching(program, sample.inputs);
  if (std::get<0>(GetParam()).above > 0.0)
    EXPECT_EQ(touching, 0);
  else
    EXPECT_GE(touching, 20);
  const auto of = [&](const std::vector<Complex>& probe) { return loss(program, probe); };
  expect_sums_agree(sample.scene.layout, of, sample.inputs, gradient(program, sample.inputs), 1e-8);
}

// Of frames alone, and along the density, which scales them and the particles' masses.
TEST_P(LaidRod, HasTheGradientOfComplexStepsWithRespectToInertiaAndDensity) {
  const auto found = gradient(program, sample.inputs);
  const std::size_t mass = sample.scene.layout.of(Quantity::mass), inertia = mass + links + 1, end = inertia + links;
  const auto along = [&](std::size_t first, std::size_t last) {
    std::vector<Complex> probe(sample.inputs.begin(), sample.inputs.end());
    for (std::size_t i = first; i < last; ++i) probe[i].im = complex_step * sample.inputs[i];
    return loss(program, probe).im / complex_step;
  };
  double sum = 0.0, largest = 0.0, largest_of_frames = 0.0;
  for (std::size_t i = mass; i < end; ++i) {
    const double own = found[i] * sample.inputs[i];
    sum += own;
    largest = std::max(largest, std::abs(own));
    if (i >= inertia) largest_of_frames = std::max(largest_of_frames, std::abs(own));
  }
  for (std::size_t i = inertia; i < end; ++i)
    EXPECT_NEAR(found[i] * sample.inputs[i], along(i, i + 1), 1e-8 * largest_of_frames) << i - inertia;
  EXPECT_NEAR(sum, along(mass, end), 1e-8 * largest);
}

TEST_P(LaidRod, HasTheSameBitsWhateverKeepsItsStates) {
  expect_bits_of_any_tape(program, sample.inputs);
  InputsOfLanes inputs(Pack::lanes, sample.inputs);
  inputs[3][sample.scene.layout.of(Quantity::gravity) + 2] = -9.5;
  inputs[4][sample.scene.layout.of(Quantity::friction)] *= 1.1;
  expect_bits_of_lanes(program, inputs, {3, 4, 5});
}

}  // namespace
}  // namespace sheetbend::testing
