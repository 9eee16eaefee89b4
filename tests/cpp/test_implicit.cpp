// Implicit blocks: the Hessians of one constraint against complex steps, a matrix without its negative eigenvalues, saddles, the end of patience, and the
// way back. Their gradients, lanes and threads are in the tests over all solvers.
#include <Eigen/Eigenvalues>

#include "core/element/any_kind_hessian.h"
#include "core/scalar/complex.h"
#include "core/solver/newton_matrix.h"
#include "tests/cpp/support/case.h"
#include "tests/cpp/support/programs.h"

namespace sheetbend::testing {
namespace {

using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

TEST(SecondOrder, IsTheDerivativeOfTheGradient) {
  for (int kind = 0; kind < kind_count; ++kind) {
    SCOPED_TRACE(kind_name(kind));
    const Case sample = case_of(kind);
    AnyConstraint<double> plain;
    std::copy(sample.x.begin(), sample.x.end(), plain.x);
    plain.evaluate(kind, sample.p.data());
    const int rows = plain.kind->rows, dofs = plain.kind->dofs;
    std::vector<double> lambda, J(rows * dofs), H(triangle(dofs)), expected;
    for (int j = 0; j < rows; ++j) lambda.push_back(3.0 - 1.7 * j);
    add_hessian(kind, sample.x.data(), sample.p.data(), lambda.data(), J.data(), H.data());
    EXPECT_TRUE(std::equal(J.begin(), J.end(), plain.J));
    const std::vector<Complex> p(sample.p.begin(), sample.p.end());
    AnyConstraint<Complex> near;
    for (int b = 0; b < dofs; ++b) {
      std::copy(sample.x.begin(), sample.x.end(), near.x);
      near.x[b].im = complex_step;
      near.evaluate(kind, p.data());
      for (int a = 0; a <= b; ++a) {
        double sum = 0.0;
        for (int j = 0; j < rows; ++j) sum += lambda[j] * near.J[j * dofs + a].im / complex_step;
        expected.push_back(sum);
      }
    }
    EXPECT_LE(relative_error(H, expected), 1e-13);
  }
}

TEST(MakeConvex, TakesTheNegativeEigenvaluesAway) {
  Random random(3);
  constexpr int n = 9;
  Square A(n, n);
  for (double& a : A.reshaped()) a = random(-1.0, 1.0);
  A = Square(A + A.transpose());
  Square convex = A;
  make_convex(n, convex.data());
  const Eigen::SelfAdjointEigenSolver<Square> modes(A), left(convex);
  ASSERT_LT(modes.eigenvalues()[0], -0.1);
  EXPECT_LE((left.eigenvalues() - modes.eigenvalues().cwiseMax(0.0)).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_LE((convex - A - (convex - A).transpose()).cwiseAbs().maxCoeff(), 1e-13);
  const Square again = convex + Square::Identity(n, n);
  Square same = again;
  make_convex(n, same.data());
  EXPECT_EQ(same, again);
}

// Two springs in a line between pins, longer by a fifth than the gap: a flat start that no force pushes aside.
struct PressedSprings {
  Scene scene;
  std::vector<double> inputs;
  PressedSprings() {
    SceneSpec spec;
    spec.particles = 3;
    spec.pinned = {0, 2};
    spec.groups = {{"springs", "distance", false, {0, 1, 1, 2}}};
    scene = build_scene(spec);
    inputs.resize(scene.layout.total());
    const Inputs<double> in{scene.layout, inputs.data()};
    std::copy_n(std::vector{0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0}.begin(), 9, in.of(Quantity::position));
    std::fill_n(in.of(Quantity::mass), 3, 1.0);
    std::fill_n(in.of(Quantity::compliance), 2, 1e-2);
    std::fill_n(in.of(Quantity::rest), 2, 1.2);
  }
  std::vector<double> middle(double h, int iterations = 100) const {
    const Plan plan = make_plan(
        scene, {.h = h, .integrator = Integrator::bdf1, .partition = Partition::implicit, .iterations = iterations});
    const auto x = states(Program{scene, plan, 1}, inputs);
    return {x.begin() + scene.dofs() + 3, x.begin() + scene.dofs() + 6};
  }
};

// Their push sideways is 2 * 100 N/m * 0.2 m per m; with 1 kg the line is a minimum of the potential up to h = 1/sqrt(40) s. Beyond it the middle goes
// where m d/h^2 balances the springs.
TEST(PressedSprings, LeaveTheLineWhereTheSubstepCannotHoldIt) {
  const PressedSprings springs;
  const auto straight = springs.middle(0.15), bent = springs.middle(0.3);
  for (const double a : {straight[1], straight[2]}) EXPECT_EQ(a, 0.0);
  const double away = std::hypot(bent[1], bent[2]), length = std::hypot(1.0, away);
  EXPECT_GT(away, 0.1);
  EXPECT_NEAR(away / (0.3 * 0.3), 2.0 * 100.0 * (1.2 - length) * away / length, 1e-8);
  EXPECT_NEAR(bent[0], 1.0, 1e-9);
}

TEST(ImplicitBlocks, SayWhenAndWhereForcesDoNotBalance) {
  const PressedSprings springs;
  try {
    springs.middle(0.3, 2);
    FAIL() << "two matrices cannot be enough";
  } catch (const Unbalanced& e) {
    EXPECT_EQ(e.iterations, 2);
    EXPECT_EQ(e.substep, 1);
    EXPECT_EQ(e.node, 1);
    EXPECT_DOUBLE_EQ(e.time, 0.3);
    for (const char* part : {"after 2 Newton matrices", "at particle 1", "in substep 1 (t = 0.3 s)", "Fix:"})
      EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what();
  }
}

TEST(ImplicitBlocks, LeaveItToTheRolloutToFindWhatIsNoNumber) {
  const Solver solver{"", Integrator::bdf2, Partition::implicit, true};
  const Sample sample = random_scene(91, solver.shape());
  std::vector<double> inputs = sample.inputs;
  inputs[sample.scene.layout.of(Quantity::velocity) + 3 * 4] = std::nan("");
  const Plan plan = make_plan(sample.scene, solver.options(1));
  EXPECT_THROW(states(Program{sample.scene, plan, 2}, inputs), Diverged);
}

// With one matrix allowed no substep could be solved again.
TEST(ImplicitBlocks, AreNotSolvedOnTheWayBack) {
  const Sample sample = random_scene(92, implicit_bdf2.shape());
  SolverOptions options = implicit_bdf2.options(1);
  Program p{sample.scene, make_plan(sample.scene, options), 6};
  auto recorded = record(p, sample.inputs);
  const auto expected = gradient(p, sample.inputs, recorded);
  p.plan.options.iterations = 1;
  EXPECT_THROW(record(p, sample.inputs), Unbalanced);
  EXPECT_TRUE(same_bits(gradient(p, sample.inputs, recorded), expected));
}

TEST(ImplicitBlocks, RefuseWhatTheyCannotHold) {
  for (const SceneShape& shape :
       {SceneShape{.unilateral = true, .directors = false}, SceneShape{.volumes = true, .directors = false}})
    EXPECT_THROW(make_plan(random_scene(1, shape).scene, {.partition = Partition::implicit}), std::invalid_argument);
  const Sample sample = random_scene(1, {.directors = false});
  for (const double bad : {0.0, 1.0, std::nan("")})
    EXPECT_THROW(make_plan(sample.scene, {.partition = Partition::implicit, .force_tolerance = bad}),
                 std::invalid_argument);
}

}  // namespace
}  // namespace sheetbend::testing
