// Third rung: the block projection against its formula, its reverse and its tangent against complex step, for
// every registered constraint as a block of one and for direct blocks that couple them all.
#include <Eigen/Dense>

#include "core/scalar/complex.h"
#include "tests/cpp/support/mutant.h"
#include "tests/cpp/support/projection.h"

namespace sheetbend::testing {
namespace {

constexpr double bound = 1e-13, eta = 4e-3;
using Dual1 = Dual<double, 1>;

std::string part_name(std::size_t part) {
  const char* own[] = {"coordinates", "w", "C_r", "lambda"};
  return part < 4 ? own[part] : quantity_names[part - 4];
}

std::vector<std::size_t> part_sizes(const Projection& p) {
  const auto at = p.offsets();
  std::vector<std::size_t> sizes;
  for (std::size_t part = 0; part + 1 < at.size(); ++part) sizes.push_back(at[part + 1] - at[part]);
  return sizes;
}

// Sums of the cotangent of theta by complex step through the forward pass. What is fixed has no inverse mass to
// differentiate by.
std::vector<double> oracle_cotangent(const Projection& p, const std::vector<double>& theta,
                                     const std::vector<double>& out_bar, const SignedSums& sums) {
  return sums.by_complex_step(
      [&](const std::vector<Complex>& probe) {
        Complex sum(0.0);
        const auto out = p.forward(probe);
        for (std::size_t i = 0; i < out.size(); ++i) sum += Complex(out_bar[i]) * out[i];
        return sum;
      },
      theta);
}

// Worst relative error over the parts of theta, of its cotangent or of sums of it.
double cotangent_error(const std::vector<std::size_t>& sizes, const std::vector<double>& found,
                       const std::vector<double>& oracle, std::string* where = nullptr) {
  double worst = 0.0;
  std::size_t begin = 0;
  for (std::size_t part = 0; part < sizes.size(); ++part) {
    const auto of = [&](const std::vector<double>& v) { return std::span(v).subspan(begin, sizes[part]); };
    const double error = relative_error(of(found), of(oracle));
    if (error > worst) {
      worst = error;
      if (where) *where = part_name(part);
    }
    begin += sizes[part];
  }
  return worst;
}

// The error of the cotangent `found`, in sums of `width` neighbors: large scenes then take fewer complex steps.
double reverse_error(const Projection& p, const std::vector<double>& theta, const std::vector<double>& out_bar,
                     const std::vector<double>& found, std::size_t width = 1, std::string* where = nullptr) {
  const SignedSums sums(part_sizes(p), width);
  return cotangent_error(sums.sums_of_part(), sums.of(found), oracle_cotangent(p, theta, out_bar, sums), where);
}

// Reverse, tangent and their dot product, at one random state. Gives the error of the reverse.
double climb(const Projection& p, const std::vector<double>& inputs, unsigned seed, std::size_t width = 1) {
  Random random(seed);
  const auto theta = p.random_theta(inputs, random);
  const auto out_bar = random.vector(p.scene.dofs() + p.scene.rows);
  const auto bar = p.reverse(theta, out_bar);
  std::string where;
  const double error = reverse_error(p, theta, out_bar, bar, width, &where);
  EXPECT_LE(error, bound) << where;

  std::vector<double> direction(theta.size());
  for (std::size_t i = 0; i < theta.size(); ++i) direction[i] = random(-1.0, 1.0) * std::abs(theta[i]);
  std::vector<Dual1> probe(theta.size());
  for (std::size_t i = 0; i < theta.size(); ++i) probe[i].v = theta[i], probe[i].d[0] = direction[i];
  std::vector<double> tangent;
  for (const Dual1& d : p.forward(probe)) tangent.push_back(d.d[0]);
  const auto oracle = complex_step_along([&](const std::vector<Complex>& z) { return p.forward(z); }, theta, direction);
  const std::size_t dofs = p.scene.dofs();
  EXPECT_LE(relative_error(std::span(tangent).first(dofs), std::span(oracle).first(dofs)), bound);
  EXPECT_LE(relative_error(std::span(tangent).subspan(dofs), std::span(oracle).subspan(dofs)), bound);

  double size = 0.0;
  for (std::size_t i = 0; i < theta.size(); ++i) size += std::abs(direction[i] * bar[i]);
  EXPECT_LE(std::abs(dot(tangent, out_bar) - dot(direction, bar)), bound * size);
  return error;
}

// Of one kind, by its number.
struct BlockOfOne : ::testing::TestWithParam<int> {
  int kind = GetParam();
  Case row = case_of(kind);

  std::vector<Partition> partitions() const {
    bool unilateral = false;
    with_kind(kind, [&]<class K>(K) { unilateral = K::unilateral; });
    if (unilateral) return {Partition::gauss_seidel};
    return {Partition::gauss_seidel, Partition::direct, Partition::newton};
  }
};
INSTANTIATE_TEST_SUITE_P(, BlockOfOne, ::testing::Range(0, kind_count),
                         [](const auto& info) { return kind_name(info.param); });

TEST_P(BlockOfOne, DerivativesMatchComplexStep) {
  const int arity = static_cast<int>(row.x.size()) / 3;
  double worst = 0.0;
  for (const Partition partition : partitions())
    for (const bool damped : {false, true})
      for (int pinned = -1; pinned < arity; ++pinned)
        for (unsigned seed = 0; seed < 5; ++seed) {
          SCOPED_TRACE(::testing::Message()
                       << "direct " << static_cast<int>(partition) << " damped " << damped << " pinned " << pinned);
          const Sample sample =
              scene_of_one(kind, seed, damped, pinned < 0 ? std::vector<int>{} : std::vector<int>{pinned});
          worst = std::max(worst, climb(Projection(sample.scene, partition, eta), sample.inputs, seed));
        }
  record_error("vjp", worst);
}

// The formula of the reverse, spelled out for one constraint, so that a mutant can go through it.
template <class K>
void reverse_element(const Projection& p, Projection::Run<double>& run, const SubstepCotangent<double>& bar) {
  const Group& group = p.scene.groups[0];
  const Placed<K, double> e(run.state, group, 0, run.record.x.data());
  double x_bar[K::dofs];
  ElementCotangent<K, double> own;
  std::copy_n(bar.x, K::dofs, x_bar);
  correction_vjp(e, Kept<K, double>(e.x), run.record.lambda.data(), e.references(run.state, group),
                 run.record.dl.data(), bar.lambda, x_bar, bar.w, own);
  add_element(run.state, group, 0, own, bar);
  add_cotangent(run.state, e, 0, x_bar, bar);
}

template <template <class> class Form>
std::vector<double> reverse_of_one(int kind, const Projection& p, const std::vector<double>& theta,
                                   const std::vector<double>& out_bar) {
  decltype(&reverse_element<Distance>) reverse = nullptr;
  with_kind(kind, [&]<class K>(K) { reverse = reverse_element<Form<K>>; });
  return p.reverse_with(
      theta, out_bar, [&](Projection::Run<double>& run, const SubstepCotangent<double>& bar) { reverse(p, run, bar); });
}
template <class K>
using Itself = K;

TEST_P(BlockOfOne, MutantIsFlagged) {
  const Sample sample = scene_of_one(kind, 0, true);
  const Projection p(sample.scene, Partition::gauss_seidel, eta);
  Random random(0);
  const auto theta = p.random_theta(sample.inputs, random);
  const auto out_bar = random.vector(p.scene.dofs() + p.scene.rows);
  EXPECT_LE(reverse_error(p, theta, out_bar, reverse_of_one<Itself>(kind, p, theta, out_bar)), bound);
  const double mutant = reverse_error(p, theta, out_bar, reverse_of_one<Mutant>(kind, p, theta, out_bar));
  EXPECT_EQ(mutant > 1e4 * bound, row.curved) << "error " << mutant << "; a linear C has no Hessian term to scale";
}

TEST_P(BlockOfOne, ShortcutsGiveWhatTheGeneralRouteGives) {
  for (const bool damped : {false, true}) {
    const Sample sample = scene_of_one(kind, 3, damped);
    const Projection p(sample.scene, Partition::gauss_seidel, eta);
    Random random(3);
    const auto theta = p.random_theta(sample.inputs, random);
    const auto out_bar = random.vector(p.scene.dofs() + p.scene.rows);
    EXPECT_LE(cotangent_error(part_sizes(p), reverse_of_one<Itself>(kind, p, theta, out_bar),
                              reverse_of_one<WithoutShortcuts>(kind, p, theta, out_bar)),
              bound);
  }
}

// At compliance 0 the linearized constraint holds exactly, and small compliances approach that in proportion.
TEST_P(BlockOfOne, VanishingComplianceIsTheRigidLimit) {
  Sample sample = scene_of_one(kind, 1, true);
  const Projection p(sample.scene, Partition::gauss_seidel, eta);
  Random random(1);
  auto theta = p.random_theta(sample.inputs, random);
  std::fill_n(theta.begin() + static_cast<std::ptrdiff_t>(p.offsets()[3]), p.scene.rows, 0.0);
  double& compliance = theta[p.inputs_at() + p.scene.layout.of(Quantity::compliance)];
  const double sample_compliance = compliance;

  compliance = 0.0;
  const auto rigid = p.forward(theta);
  AnyConstraint<double> value;
  const int rows = p.scene.rows, dofs = p.scene.dofs();
  std::copy_n(theta.data(), dofs, value.x);
  value.evaluate(kind, &theta[p.inputs_at() + p.scene.layout.of(Quantity::rest)]);
  for (int j = 0; j < rows; ++j) {
    double left = value.C[j];
    for (int d = 0; d < dofs; ++d) left += value.J[j * dofs + d] * (rigid[d] - theta[d]);
    EXPECT_LE(std::abs(left), 1e-13 * largest({value.C, static_cast<std::size_t>(rows)}));
  }
  double previous = 0.0;
  for (const double fraction : {1e-4, 1e-5, 1e-6}) {
    compliance = fraction * sample_compliance;
    const auto out = p.forward(theta);
    double distance = 0.0;
    for (int d = 0; d < dofs; ++d) distance = std::max(distance, std::abs(out[d] - rigid[d]));
    EXPECT_GT(distance, 0.0);
    EXPECT_NEAR(previous == 0.0 ? 10.0 : previous / distance, 10.0, 0.1);
    previous = distance;
  }
}

// Taut, it holds its length; slack, it does nothing, and gives back what its multiplier had done.
TEST(Tether, PushesInAndNeverOut) {
  Sample sample = scene_of_one(kind_of(Tether::name), 4, false);
  const Projection p(sample.scene, Partition::gauss_seidel, eta);
  Random random(4);
  auto theta = p.random_theta(sample.inputs, random);
  double &lambda = theta[p.offsets()[3]], &length = theta[p.inputs_at() + p.scene.layout.of(Quantity::rest)];
  theta[p.inputs_at() + p.scene.layout.of(Quantity::compliance)] = 0.0;
  const auto distance = [](const std::vector<double>& x) { return norm(Vec3<double>(&x[3]) - Vec3<double>(&x[0])); };
  const double start = distance(theta);
  const auto out_bar = random.vector(p.scene.dofs() + p.scene.rows);
  struct Expected {
    double length, lambda, distance_moved;
  };
  for (const auto& [part, before, moved] : {Expected{0.8, 0.0, -0.2}, {1.2, 0.0, 0.0}, {1.2, 1e-5, 0.0}}) {
    length = part * start;
    lambda = before;
    const auto out = p.forward(theta);
    const double w = theta[p.offsets()[1]] + theta[p.offsets()[1] + 1];
    EXPECT_NEAR(distance(out), start * (1.0 + moved) + before * w, 1e-15);
    EXPECT_NEAR(out.back(), -moved * start / w, 1e-17);
    EXPECT_LE(reverse_error(p, theta, out_bar, p.reverse(theta, out_bar)), bound);
  }
}

// Dense A, s, dl and the outputs from the formulas on paper, for one block that holds all constraints of the
// scene.
std::vector<double> by_formula(const Projection& p, const std::vector<double>& theta) {
  const Scene& scene = p.scene;
  const auto at = p.offsets();
  const Inputs<const double> in{scene.layout, &theta[at[4]]};
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(scene.rows, scene.dofs());
  Eigen::VectorXd s(scene.rows), a(scene.rows), g(scene.rows), w = Eigen::VectorXd::Zero(scene.dofs());
  for (int d = 0; d < scene.dofs(); ++d)
    if (scene.role[d / 3] == Role::free) w[d] = theta[at[1] + d / 3];
  for (const Group& group : scene.groups)
    for (int i = 0; i < group.count; ++i) {
      const int dofs = 3 * group.arity;
      AnyConstraint<double> value;
      for (int d = 0; d < dofs; ++d) value.x[d] = theta[3 * group.nodes(i)[d / 3] + d % 3];
      value.evaluate(group.kind, in.of(Quantity::rest) + group.first_value + i * group.parameters);
      const double alpha = in.of(Quantity::compliance)[group.first + i],
                   beta = in.of(Quantity::damping)[group.first + i];
      for (int j = 0; j < group.rows; ++j) {
        const int row = group.first_row + i * group.rows + j;
        a[row] = alpha / (p.eta * p.eta);
        g[row] = group.damped ? alpha * beta / p.eta : 0.0;
        s[row] =
            value.C[j] + a[row] * theta[at[3] + row] + g[row] * value.kind->difference(value.C[j], theta[at[2] + row]);
        for (int d = 0; d < dofs; ++d) J(row, 3 * group.nodes(i)[d / 3] + d % 3) = value.J[j * dofs + d];
      }
    }
  Eigen::MatrixXd A = J * w.asDiagonal() * J.transpose();
  A.diagonal().array() += a.array() / (1.0 + g.array());
  Eigen::VectorXd dl = A.partialPivLu().solve(Eigen::VectorXd(-s.array() / (1.0 + g.array())));
  for (const Group& group : scene.groups)  // only ever alone in its block
    if (group.unilateral) dl[0] = std::max(dl[0], -theta[at[3]]);
  const Eigen::VectorXd dx = w.cwiseProduct(J.transpose() * dl);
  std::vector<double> out(theta.begin(), theta.begin() + scene.dofs());
  for (int d = 0; d < scene.dofs(); ++d) out[d] += dx[d];
  for (int r = 0; r < scene.rows; ++r) out.push_back(theta[at[3] + r] + dl[r]);
  return out;
}

void expect_formula(const Projection& p, const std::vector<double>& theta) {
  const auto found = p.forward(theta), expected = by_formula(p, theta);
  const auto moved = [&](std::vector<double> out) {
    for (int d = 0; d < p.scene.dofs(); ++d) out[d] -= theta[d];
    return out;
  };
  const auto dx = moved(found), dx_expected = moved(expected);
  const std::size_t dofs = p.scene.dofs();
  EXPECT_LE(relative_error(std::span(dx).first(dofs), std::span(dx_expected).first(dofs)), 1e-12);
  EXPECT_LE(relative_error(std::span(found).subspan(dofs), std::span(expected).subspan(dofs)), 1e-12);
}

TEST_P(BlockOfOne, FollowsTheFormula) {
  for (const Partition partition : partitions())
    for (const bool damped : {false, true}) {
      const Sample sample = scene_of_one(kind, 2, damped, {0});
      const Projection p(sample.scene, partition, eta);
      Random random(2);
      expect_formula(p, p.random_theta(sample.inputs, random));
    }
}

struct CoupledBlocks : ::testing::TestWithParam<bool> {};

TEST_P(CoupledBlocks, FollowTheFormula) {
  const Sample sample = random_scene(11, {.net = GetParam()});
  const Projection p(sample.scene, Partition::direct, eta);
  Random random(3);
  expect_formula(p, p.random_theta(sample.inputs, random));
}

TEST_P(CoupledBlocks, DerivativesMatchComplexStep) {
  double worst = 0.0;
  for (unsigned seed = 20; seed < 23; ++seed) {
    const Sample sample = random_scene(seed, {.net = GetParam()});
    worst = std::max(worst, climb(Projection(sample.scene, Partition::direct, eta), sample.inputs, seed, 24));
  }
  record_error("vjp", worst);
}

TEST_P(CoupledBlocks, HaveTheSameBitsOnEveryInstructionSet) {
  const Sample sample = random_scene(24, {.net = GetParam()});
  for (const Partition partition : {Partition::direct, Partition::newton, Partition::newton_cg}) {
    Projection p(sample.scene, partition, eta);
    Random random(24);
    const auto theta = p.random_theta(sample.inputs, random);
    const auto out_bar = random.vector(p.scene.dofs() + p.scene.rows);
    const auto forward = p.forward(theta), reverse = p.reverse(theta, out_bar);
    for (const auto* kernels : available_kernels()) {
      p.kernels = kernels;
      EXPECT_TRUE(same_bits(p.forward(theta), forward)) << kernels->name;
      EXPECT_TRUE(same_bits(p.reverse(theta, out_bar), reverse)) << kernels->name;
    }
  }
}

TEST_P(CoupledBlocks, DampingReferencesHaveTheSameBitsOnEveryInstructionSet) {
  const Sample sample = random_scene(26, {.net = GetParam()});
  const Projection p(sample.scene, Partition::direct, eta);
  Random random(26);
  const Projection::Run<double> run(p, p.random_theta(sample.inputs, random));
  std::vector<double> x = run.theta, x_before = run.theta;
  for (double& a : x_before) a += random(-0.005, 0.005);
  const auto references = [&](const DirectBlock& block, const sheetbend_packs::KernelTable& kernels) {
    BlockState<double> state;
    state.resize(p.scene, block, 0);
    begin_block(run.state, block, state);
    damping_references(run.state, block, kernels, -1.0 / 3.0, {x.data(), x_before.data(), nullptr, nullptr}, state);
    return std::vector<double>(state.C_r.data(), state.C_r.data() + block.size());
  };
  for (const DirectBlock& block : p.plan.blocks)
    for (const auto* kernels : available_kernels())
      EXPECT_TRUE(same_bits(references(block, *kernels), references(block, pack_kernels()))) << kernels->name;
}

// Eight states in the lanes against one state at a time.
TEST_P(CoupledBlocks, HaveTheSameBitsInEveryLane) {
  const Sample sample = random_scene(25, {.net = GetParam()});
  for (const Partition partition : {Partition::direct, Partition::newton, Partition::newton_cg}) {
    Projection p(sample.scene, partition, eta);
    Random random(25);
    std::vector<std::vector<double>> theta;
    for (int lane = 0; lane < Pack::lanes; ++lane) theta.push_back(p.random_theta(sample.inputs, random));
    std::vector<Pack> packed(theta[0].size());
    for (std::size_t i = 0; i < packed.size(); ++i) packed[i] = per_lane([&](int lane) { return theta[lane][i]; });
    for (const auto* kernels : available_kernels()) {
      p.kernels = kernels;
      const auto found = p.forward(packed);
      for (int lane = 0; lane < Pack::lanes; ++lane) {
        std::vector<double> own;
        for (const Pack& a : found) own.push_back(a[lane]);
        EXPECT_TRUE(same_bits(own, p.forward(theta[lane]))) << kernels->name << ", lane " << lane;
      }
    }
  }
}

// Eight directions, and the first four of them, beside the values; every output along every direction.
TEST_P(CoupledBlocks, TangentsMatchComplexStepOnEveryInstructionSet) {
  const Sample sample = random_scene(27, {.net = GetParam()});
  Projection p(sample.scene, Partition::direct, eta);
  Random random(27);
  const auto theta = p.random_theta(sample.inputs, random);
  std::vector<std::vector<double>> along;
  for (int k = 0; k < 8; ++k) along.push_back(random.vector(theta.size()));
  for (auto& v : along)
    for (std::size_t i = 0; i < v.size(); ++i) v[i] *= std::abs(theta[i]);
  std::vector<Dual<double, 8>> eight(theta.begin(), theta.end());
  std::vector<Dual<double, 4>> four(theta.begin(), theta.end());
  for (std::size_t i = 0; i < theta.size(); ++i) {
    for (int k = 0; k < 8; ++k) eight[i].d[k] = along[k][i];
    std::copy_n(eight[i].d, 4, four[i].d);
  }
  const auto direction = [](const auto& found, int k) {
    std::vector<double> out;
    for (const auto& a : found) out.push_back(k < 0 ? a.v : a.d[k]);
    return out;
  };
  const auto values = p.forward(theta);
  const auto expected = p.forward(eight);
  double worst = 0.0;
  for (int k = 0; k < 8; ++k)
    worst = std::max(worst,
                     relative_error(direction(expected, k),
                                    complex_step_along([&](const auto& z) { return p.forward(z); }, theta, along[k])));
  EXPECT_LE(worst, 1e-13);
  record_error("tangents", worst);
  for (const auto* kernels : available_kernels()) {
    p.kernels = kernels;
    const auto found = p.forward(eight);
    EXPECT_TRUE(same_bits(direction(found, -1), values)) << kernels->name;
    for (int k = 0; k < 8; ++k) EXPECT_TRUE(same_bits(direction(found, k), direction(expected, k))) << kernels->name;
    const auto fewer = p.forward(four);
    for (int k = -1; k < 4; ++k) EXPECT_TRUE(same_bits(direction(fewer, k), direction(found, k))) << kernels->name;
  }
}

TEST_P(CoupledBlocks, OneSweepByColorMatchesComplexStep) {
  const Sample sample = random_scene(30, {.net = GetParam(), .unilateral = true});
  record_error("vjp", climb(Projection(sample.scene, Partition::gauss_seidel, eta), sample.inputs, 30, 8));
}

// Two rigid arms of four particles and six distances that share one particle: what a double pendulum is made
// of.
TEST(CoupledArms, FollowTheFormulaAndMatchComplexStep) {
  SceneSpec spec;
  spec.particles = 7;
  spec.pinned = {0};
  std::vector<int> pairs;
  for (const auto& arm : {std::array{0, 1, 2, 3}, std::array{3, 4, 5, 6}})
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < a; ++b) pairs.insert(pairs.end(), {arm[b], arm[a]});
  spec.groups = {{"arms", "distance", false, pairs}};
  const Projection p(build_scene(spec), Partition::direct, eta);
  const std::vector<double> x{0,    0,    0,    0.1,  0.06, -0.05, 0.1,  -0.07, -0.04, 0.13, 0.01,
                              0.08, 0.24, 0.07, 0.03, 0.22, -0.07, 0.04, 0.26,  0.02,  0.17};
  std::vector<double> inputs(p.scene.layout.total());
  std::copy(x.begin(), x.end(), inputs.begin());
  for (int c = 0; c < p.scene.constraints; ++c) {
    const double *a = &x[3 * pairs[2 * c]], *b = &x[3 * pairs[2 * c + 1]];
    inputs[p.scene.layout.of(Quantity::rest) + c] = norm(Vec3<double>(b) - Vec3<double>(a));
  }
  Random random(4);
  expect_formula(p, p.random_theta(inputs, random));
  record_error("vjp", climb(p, inputs, 4));
}

INSTANTIATE_TEST_SUITE_P(, CoupledBlocks, ::testing::Bool(),
                         [](const auto& param) { return param.param ? "Net" : "Ropes"; });

}  // namespace
}  // namespace sheetbend::testing
