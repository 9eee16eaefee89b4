// Conjugate gradients: they solve, in lanes as alone; they end where there is nothing to do or nothing to hope for. And BiCGSTAB.
#include "core/linear/conjugate_gradients.h"

#include "core/linear/bicgstab.h"
#include "core/scalar/dual.h"
#include "tests/cpp/support/programs.h"

namespace sheetbend::testing {
namespace {

constexpr int particles = 40;
constexpr Stopping tight{1e-14, 1000};

// A chain of unit masses and springs of growing stiffness, coordinate by coordinate, preconditioned by its diagonal.
template <class T>
struct Springs {
  T stiffness;

  T spring(int i) const { return stiffness * T(1.0 + i); }
  void multiply(const T* p, T* q) const {
    for (int d = 0; d < 3 * particles; ++d) q[d] = p[d];
    for (int i = 0; i + 1 < particles; ++i)
      for (int d = 3 * i; d < 3 * i + 3; ++d) {
        const T force = spring(i) * (p[d + 3] - p[d]);
        q[d] -= force;
        q[d + 3] += force;
      }
  }
  void precondition(const T* r, T* z) const {
    for (int i = 0; i < particles; ++i) {
      const T diagonal = T(1.0) + (i > 0 ? spring(i - 1) : T(0.0)) + (i + 1 < particles ? spring(i) : T(0.0));
      for (int d = 3 * i; d < 3 * i + 3; ++d) z[d] = r[d] / diagonal;
    }
  }
};

template <class T>
int solve(const T& stiffness, std::vector<T>& b, const Stopping& stop = tight) {
  std::vector<T> work(3 * b.size());
  return conjugate_gradients(Springs<T>{stiffness}, particles, stop, b.data(), work.data());
}

TEST(ConjugateGradients, Solve) {
  Random random(1);
  const std::vector<double> x = random.vector(3 * particles);
  std::vector<double> b(x.size());
  Springs<double>{30.0}.multiply(x.data(), b.data());
  const int iterations = solve(30.0, b);
  EXPECT_LE(relative_error(b, x), 1e-13);
  EXPECT_GT(iterations, 10);
  EXPECT_LE(iterations, 2 * particles);
}

// Each lane has a matrix and a right side of its own; one has nothing to solve, one is no number.
TEST(ConjugateGradients, LanesHaveTheBitsThatTheyHaveAlone) {
  Random random(2);
  std::vector<std::vector<double>> alone;
  for (int lane = 0; lane < Pack::lanes; ++lane) alone.push_back(random.vector(3 * particles));
  std::fill(alone[3].begin(), alone[3].end(), 0.0);
  alone[5][7] = std::nan("");
  const auto stiffness = [](int lane) { return std::pow(4.0, lane); };
  std::vector<Pack> together(3 * particles);
  for (std::size_t i = 0; i < together.size(); ++i) together[i] = per_lane([&](int lane) { return alone[lane][i]; });
  const int most = solve(per_lane(stiffness), together);
  std::vector<int> iterations;
  for (int lane = 0; lane < Pack::lanes; ++lane) {
    iterations.push_back(solve(stiffness(lane), alone[lane]));
    if (lane == 5) continue;
    std::vector<double> own;
    for (const Pack& a : together) own.push_back(a[lane]);
    EXPECT_TRUE(same_bits(own, alone[lane])) << "lane " << lane;
  }
  EXPECT_EQ(most, *std::max_element(iterations.begin(), iterations.end()));
  EXPECT_EQ(iterations[3], 0);
  EXPECT_EQ(iterations[5], 0);
  EXPECT_LT(iterations[0], iterations[7]);
}

TEST(ConjugateGradients, SayWhenTheyRunOut) {
  std::vector<double> b(3 * particles, 0.0);
  b[0] = 1.0;
  try {
    solve(1e6, b, {1e-14, 5});
    FAIL() << "five iterations cannot be enough";
  } catch (const Unconverged& e) {
    EXPECT_EQ(e.iterations, 5);
    EXPECT_GT(e.residual, 1e-14);
    for (const char* part : {"after 5 iterations", "tolerance of 1.00e-14", "Fix:"})
      EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what();
  }
}

// A net's rollout is that of the factored matrix; its plan knows no pattern of that.
TEST(NewtonByConjugateGradients, IsNewtonFactored) {
  const Sample sample = random_scene(90, {.net = true});
  const auto run = [&](Partition partition) {
    return Program{sample.scene, make_plan(sample.scene, {.h = 4e-3, .partition = partition}), 10};
  };
  const Program factored = run(Partition::newton), iterated = run(Partition::newton_cg);
  EXPECT_LE(relative_error(states(iterated, sample.inputs), states(factored, sample.inputs)), 1e-10);
  expect_gradients_agree(sample.scene.layout, gradient(iterated, sample.inputs), gradient(factored, sample.inputs),
                         1e-9);
  for (const DirectBlock& block : iterated.plan.blocks)
    EXPECT_TRUE(std::holds_alternative<CondensedIteration>(block.condensation.value()));
}

TEST(NewtonByConjugateGradients, LeavesItToTheRolloutToFindWhatIsNoNumber) {
  const Sample sample = random_scene(91, {.net = true});
  std::vector<double> inputs = sample.inputs;
  inputs[sample.scene.layout.of(Quantity::velocity) + 3 * 4] = std::nan("");
  const Plan plan = make_plan(sample.scene, {.h = 4e-3, .partition = Partition::newton_cg});
  EXPECT_THROW(states(Program{sample.scene, plan, 2}, inputs), Diverged);
}

TEST(NewtonByConjugateGradients, EndsWithItsIterations) {
  const Sample sample = random_scene(92, {.net = true});
  const Plan plan =
      make_plan(sample.scene, {.h = 4e-3, .partition = Partition::newton_cg, .cg_iterations = 3, .threads = 2});
  EXPECT_THROW(states(Program{sample.scene, plan, 2}, sample.inputs), Unconverged);
  for (const SolverOptions& bad : {SolverOptions{.cg_tolerance = 0.0}, SolverOptions{.cg_tolerance = 1.0},
                                   SolverOptions{.cg_tolerance = std::nan("")}, SolverOptions{.cg_iterations = 0}})
    EXPECT_THROW(make_plan(sample.scene, bad), std::invalid_argument);
}

// A chain of springs that pull one end more than the other, as friction does, in rows of four numbers of which the last stays zero.
struct OneSided {
  double skew;

  void multiply(Numbers<double>& p, Numbers<double>& q) const {
    for (int i = 0; i < 4 * particles; ++i) {
      q[i] = i % 4 == 3 ? 0.0 : 4.0 * p[i];
      if (i >= 4) q[i] -= (1.0 + skew) * p[i - 4];
      if (i + 4 < 4 * particles) q[i] -= (1.0 - skew) * p[i + 4];
    }
  }
  void precondition(const double* r, double* y) const {
    for (int i = 0; i < 4 * particles; ++i) y[i] = 0.25 * r[i];
  }
};

TEST(Bicgstab, SolvesWithAMatrixThatIsNotSymmetric) {
  for (const double skew : {0.0, 0.5, 2.0}) {
    Bicgstab krylov;
    krylov.resize(particles, 2);
    Numbers<double> wanted, made;
    wanted.assign(4 * (particles + 2));
    made.assign(4 * (particles + 2));
    Random random(94);
    for (int i = 0; i < 4 * particles; ++i) wanted[i] = i % 4 == 3 ? 0.0 : random(-1.0, 1.0);
    const OneSided matrix{skew};
    matrix.multiply(wanted, made);
    std::copy_n(made.data(), 4 * particles, krylov.b.data());
    ASSERT_TRUE(krylov.solve(matrix, 1e-13, 200)) << skew;
    for (int i = 0; i < 4 * (particles + 2); ++i) EXPECT_NEAR(krylov.x[i], wanted[i], 1e-11) << skew;
    std::copy_n(made.data(), 4 * particles, krylov.b.data());
    EXPECT_FALSE(krylov.solve(matrix, 1e-13, 2)) << "two iterations do not do";
    std::fill_n(krylov.b.data(), 4 * particles, 0.0);
    EXPECT_TRUE(krylov.solve(matrix, 1e-13, 0)) << "zero is its own answer";
  }
}

}  // namespace
}  // namespace sheetbend::testing
