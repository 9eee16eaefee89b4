// Fifth rung: gradients of whole rollouts against complex step through the templated solver; and the physics
// of a rollout that needs no closed form.
#include "core/scalar/complex.h"
#include "tests/cpp/support/programs.h"

namespace sheetbend::testing {
namespace {

struct RolloutOf : ::testing::TestWithParam<Solver> {};
INSTANTIATE_TEST_SUITE_P(, RolloutOf, all_solvers, solver_name);

TEST_P(RolloutOf, GradientMatchesComplexStep) {
  for (const unsigned seed : {50u, 51u}) {
    const Sample sample = random_scene(seed, GetParam().shape());
    const Program program{sample.scene, make_plan(sample.scene, GetParam().options(2)), 6, 0.004};
    const SignedSums sums(sample.scene.layout.size, 96);
    const auto oracle =
        sums.by_complex_step([&](const std::vector<Complex>& z) { return loss(program, z); }, sample.inputs);
    Layout layout;
    std::ranges::copy(sums.sums_of_part(), layout.size.begin());
    layout.close();
    expect_gradients_agree(layout, sums.of(gradient(program, sample.inputs)), oracle, 1e-8);
  }
}

// The scenes must hold what is hard: constraints of one color, and two blocks, that share a driven particle;
// branches and loops.
TEST(RandomScene, SharesADrivenParticleWithinAColorAndBetweenBlocks) {
  const Scene scene = random_scene(50).scene;
  int colors_sharing = 0;
  for (const Color& color : make_plan(scene, {.partition = Partition::gauss_seidel}).colors) {
    int users = 0;
    for (const int item : color.items)
      for (const int node : scene.groups[color.group].nodes(item)) users += node == 0;
    colors_sharing += users > 1;
  }
  EXPECT_GT(colors_sharing, 0);
  int blocks_using = 0;
  for (const DirectBlock& block : make_plan(scene, {.partition = Partition::direct}).blocks)
    blocks_using += std::any_of(block.members.begin(), block.members.end(), [&](const Member& m) {
      const auto nodes = scene.groups[m.group].nodes(m.item);
      return std::find(nodes.begin(), nodes.end(), 0) != nodes.end();
    });
  EXPECT_EQ(blocks_using, 5);
}

TEST(RandomScene, NetIsSparse) {
  const Plan plan = make_plan(random_scene(50, {.net = true}).scene, {.partition = Partition::direct});
  EXPECT_TRUE(
      std::any_of(plan.blocks.begin(), plan.blocks.end(), [](const DirectBlock& b) { return !b.structure.banded(); }));
}

// Mass, forces, drag and the air's coefficients times c, compliance over c (and beta times c, for alpha beta is what damps): the same
// motion.
TEST_P(RolloutOf, MassGaugeMovesNothing) {
  const Sample sample = random_scene(52, GetParam().shape());
  const Program program{sample.scene, make_plan(sample.scene, GetParam().options(2)), 10};
  std::vector<double> scaled = sample.inputs;
  const Layout& layout = sample.scene.layout;
  const auto scale = [&](Quantity q, double factor) {
    for (std::size_t i = 0; i < layout.count(q); ++i) scaled[layout.of(q) + i] *= factor;
  };
  const double c = 4.0;  // a power of two: every product keeps its bits
  scale(Quantity::mass, c);
  scale(Quantity::compliance, 1.0 / c);
  scale(Quantity::damping, c);
  scale(Quantity::force, c);
  scale(Quantity::load, c);
  scale(Quantity::drag_linear, c);
  scale(Quantity::drag_quadratic, c);
  scale(Quantity::air_normal, c);
  scale(Quantity::air_tangential, c);
  scale(Quantity::pressure, c);
  scale(Quantity::volume_compliance, 1.0 / c);
  EXPECT_TRUE(same_bits(states(program, sample.inputs), states(program, scaled)));
}

// Free fall without constraints: BDF1 is implicit Euler, x_n = x_0 + n h v_0 + h^2 g n (n + 1)/2.
TEST(RolloutOfOneParticle, FallsAsImplicitEulerDoes) {
  SceneSpec spec;
  spec.particles = 1;
  const Scene scene = build_scene(spec);
  std::vector<double> inputs(scene.layout.total());
  const Inputs<double> in{scene.layout, inputs.data()};
  in.of(Quantity::mass)[0] = 0.3;
  in.of(Quantity::velocity)[0] = 2.0;
  in.of(Quantity::gravity)[2] = -10.0;
  const double h = 0.01;
  const std::vector<double> x =
      states(Program{scene, make_plan(scene, {.h = h, .integrator = Integrator::bdf1}), 50}, inputs);
  for (int n = 0; n <= 50; ++n) {
    EXPECT_NEAR(x[3 * n], 2.0 * n * h, 1e-14);
    EXPECT_NEAR(x[3 * n + 2], -10.0 * h * h * n * (n + 1) / 2, 1e-13);
  }
}

TEST(RolloutThatDiverges, SaysWhereAndWhen) {
  const Sample sample = random_scene(53);
  std::vector<double> inputs = sample.inputs;
  inputs[sample.scene.layout.of(Quantity::velocity) + 3 * 4] = std::nan("");
  try {
    states(Program{sample.scene, make_plan(sample.scene, {.partition = Partition::gauss_seidel, .iterations = 1}), 5},
           inputs);
    FAIL() << "a NaN went unnoticed";
  } catch (const Diverged& e) {
    EXPECT_EQ(e.substep, 1);
    EXPECT_NE(std::string(e.what()).find("Fix:"), std::string::npos);
  }
}

struct StopAtOnce : Interrupt {
  void poll() override { throw std::runtime_error("stopped"); }
};

TEST(RolloutInterrupted, Stops) {
  const Sample sample = random_scene(54);
  const Plan plan = make_plan(sample.scene, {});
  StopAtOnce stop;
  std::vector<double> x(sample.scene.dofs());
  EXPECT_THROW(rollout_states<double>(sample.scene, plan, sample.inputs.data(), 0.0, {5}, x.data(), &stop),
               std::runtime_error);
}

}  // namespace
}  // namespace sheetbend::testing
