// Fourth rung: one substep, theta = (x, x_before, v, v_before, inputs) -> (x, v), its reverse against complex step.
#include "tests/cpp/support/substeps.h"

namespace sheetbend::testing {
namespace {

struct Substep : ::testing::TestWithParam<Solver> {};
INSTANTIATE_TEST_SUITE_P(, Substep, all_solvers, solver_name);
INSTANTIATE_TEST_SUITE_P(Implicit, Substep, ::testing::Values(implicit_bdf2), solver_name);

TEST_P(Substep, ReverseMatchesComplexStep) {
  const Sample sample = random_scene(40, GetParam().shape());
  const Scene& scene = sample.scene;
  for (const int number : {0, 1}) {
    SCOPED_TRACE(number == 0 ? "the first substep" : "a later substep");
    const OneSubstep one{scene, make_plan(scene, GetParam().options(3)), number};
    Random random(40 + number);
    const auto theta = random_theta(sample, random);
    const auto out_bar = random.vector(2 * scene.dofs());
    const std::size_t dofs = scene.dofs();
    std::vector<std::size_t> parts(4, dofs);
    parts.insert(parts.end(), scene.layout.size.begin(), scene.layout.size.end());
    const SignedSums sums(parts, 64);
    const auto oracle = sums.by_complex_step(
        [&](const std::vector<Complex>& z) {
          const auto out = forward(one, z);
          Complex sum(0.0);
          for (std::size_t i = 0; i < out.size(); ++i) sum += Complex(out_bar[i]) * out[i];
          return sum;
        },
        theta);
    const auto bar = sums.of(reverse(one, theta, out_bar));
    const char* names[] = {"x", "x_before", "v", "v_before"};
    for (std::size_t part = 0, first = 0; part < parts.size(); first += sums.sums_of_part()[part++]) {
      const std::size_t size = sums.sums_of_part()[part];
      const auto found = std::span(bar).subspan(first, size), expected = std::span(oracle).subspan(first, size);
      const int q = static_cast<int>(part) - 4;
      const char* name = q < 0 ? names[part] : quantity_names[q];
      const double error = relative_error(found, expected);
      EXPECT_LE(error, 1e-10) << name;
      if (q < 0) continue;
      // A substep reads the states that it is given, not the initial ones.
      const bool initial = q == static_cast<int>(Quantity::position) || q == static_cast<int>(Quantity::velocity);
      const bool missing = (scene.volumes.empty() && is_of_volumes(q)) || (scene.contacts.empty() && is_of_contacts(q));
      EXPECT_EQ(largest(expected) > 0.0, !initial && !missing) << name;
      record_error(name, error);
    }
  }
}

// At rest in still air no speed has a direction; their slopes are taken as zero, and nothing becomes NaN.
TEST(SubstepAtRest, ReverseIsFinite) {
  Sample sample = random_scene(41);
  const Inputs<double> in{sample.scene.layout, sample.inputs.data()};
  std::fill_n(in.of(Quantity::wind), sample.scene.layout.count(Quantity::wind), 0.0);
  const OneSubstep one{sample.scene, make_plan(sample.scene, {.h = 4e-3, .integrator = Integrator::bdf2}), 1};
  Random random(41);
  auto theta = random_theta(sample, random);
  const std::size_t dofs = sample.scene.dofs();
  std::fill_n(theta.begin() + static_cast<std::ptrdiff_t>(2 * dofs), 2 * dofs, 0.0);
  for (const double b : reverse(one, theta, random.vector(2 * dofs))) EXPECT_TRUE(std::isfinite(b));
}

// Directors across an edge and across a normal, and the normal itself, of which one is held.
TEST(Retraction, ReverseMatchesComplexStep) {
  SceneSpec spec;
  spec.particles = 7;
  spec.directors = {{2, 0, 1}, {3, 0, 1, 3}, {4, 0, 1, 3}, {5, 1, 0, 5}, {6, 1, 0, 5}};
  spec.pinned = {5};
  spec.groups = {{"all", "section_curvature", false, {3, 5, 4, 6}}};
  const Scene scene = build_scene(spec);
  Random random(4);
  const std::vector<double> x = random.vector(scene.dofs()), bar = random.vector(scene.dofs());
  std::vector<double> found = bar;
  retract_directors_vjp<double>(scene, [&](int node) { return &x[scene.first_dof[node]]; }, found.data());
  for (int i = 0; i < scene.dofs(); ++i) {
    std::vector<Complex> z(x.begin(), x.end());
    z[i].im = complex_step;
    retract_directors(scene, z.data());
    double expected = 0.0;
    for (int k = 0; k < scene.dofs(); ++k) expected += bar[k] * z[k].im / complex_step;
    EXPECT_NEAR(found[i], expected, 1e-13);
  }
  for (const int free : {2, 3, 4, 6}) {
    std::vector<double> once = x;
    retract_directors(scene, once.data());
    EXPECT_NEAR(norm(Vec3<double>(&once[3 * free])), 1.0, 1e-15);
  }
}

TEST(Retraction, RefusesANormalThatComesLater) {
  SceneSpec spec;
  spec.particles = 4;
  spec.directors = {{2, 0, 1, 3}, {3, 0, 1, 3}};
  EXPECT_THROW(build_scene(spec), std::invalid_argument);
}

}  // namespace
}  // namespace sheetbend::testing
