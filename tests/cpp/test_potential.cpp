// The incremental potential of implicit blocks and its matrix: against the same sums over complex numbers, constraint by constraint, on the kernels
// of every instruction set.
#include <set>

#include "core/scalar/complex.h"
#include "core/solver/newton_matrix.h"
#include "tests/cpp/support/programs.h"

namespace sheetbend::testing {
namespace {

constexpr int row = sheetbend_blocks::row;
constexpr double eta = 2e-4;

// The blocks of a random scene, away from where forces balance.
struct PotentialCase {
  Sample sample = random_scene(93, implicit_bdf2.shape());
  Plan plan = make_plan(sample.scene, implicit_bdf2.options(1));
  Random random{93};

  const Scene& scene() const { return sample.scene; }

  // The problem of a block, and a state.
  struct Problem {
    const DirectBlock& block;
    IncrementalPotential potential;
    Numbers<double> x;
  };
  Problem problem(const DirectBlock& block) {
    Problem p{block, {}, {}};
    p.potential.resize(scene(), block);
    p.x.assign(row * block.particles.size());
    const Inputs<const double> in{scene().layout, sample.inputs.data()};
    for (std::size_t r = 0; r < block.runs.size(); ++r) {
      const MemberRun& run = block.runs[r];
      const Group& group = scene().groups[run.group];
      const int count = sheetbend_blocks::value_count(group.damped, group.parameters);
      for (std::size_t i = 0; i < run.items.size(); ++i) {
        const Rates<double> rates = rates_of(group, run.items[i]);
        const auto set = [&](int part, double a) {
          p.potential.values[r][lane_at(static_cast<int>(i), count, part)] = a;
        };
        set(0, rates.a);
        if (group.damped) set(1, rates.g), set(2, rates.scale);
        for (int k = 0; k < group.parameters; ++k)
          set(count - group.parameters + k,
              in.of(Quantity::rest)[group.first_value + static_cast<std::size_t>(run.items[i]) * group.parameters + k]);
      }
    }
    for (std::size_t n = 0; n < block.particles.size(); ++n)
      for (int d = 0; d < row; ++d) {
        const std::size_t at = row * n + d;
        const bool is_weight = d == 3;
        p.x[at] = is_weight
                      ? random(30.0, 100.0)
                      : in.of(Quantity::position)[scene().first_dof[block.particles[n]] + d] + random(-2e-3, 2e-3);
        p.potential.target[at] = is_weight ? p.x[at] : p.x[at] + random(-1e-3, 1e-3);
      }
    for (int j = 0; j < block.size(); ++j) p.potential.C_r[j] = random(-0.1, 0.1);
    for (const MemberRun& run : block.runs)  // volumes are of about a thousandth of a cubic meter
      with_kind(scene().groups[run.group].kind, [&]<class K>(K) {
        if (K::unit.meters == 3)
          for (int i = 0; i < run.count; ++i) p.potential.C_r[run.first_row[i]] *= 1e-3;
      });
    return p;
  }

  Rates<double> rates_of(const Group& group, int item) const {
    const Inputs<const double> in{scene().layout, sample.inputs.data()};
    return {in.of(Quantity::compliance)[group.first + item],
            group.damped ? in.of(Quantity::damping)[group.first + item] : 0.0, eta};
  }

  // R and Phi at x (rows of four) over any scalar.
  template <class T>
  std::vector<T> residual(Problem& p, const std::vector<T>& x, T* phi = nullptr) const {
    const Inputs<const double> in{scene().layout, sample.inputs.data()};
    std::vector<T> R(3 * p.block.movable);
    T sum(0.0);
    for (std::size_t i = 0; i < R.size(); ++i) {
      const std::size_t at = row * (i / 3) + i % 3;
      const T away = x[at] - T(p.potential.target[at]);
      R[i] = away / T(p.x[row * (i / 3) + 3]);
      sum += T(0.5) * away * R[i];
    }
    AnyConstraint<T> at;
    T own[largest_kind.parameters];
    for (const MemberRun& run : p.block.runs) {
      const Group& group = scene().groups[run.group];
      for (int i = 0; i < run.count; ++i) {
        const auto node = [&](int k) { return run.nodes[lane_at(i, group.arity, k)]; };
        for (int d = 0; d < 3 * group.arity; ++d) at.x[d] = x[node(d / 3) + d % 3];
        const double* rest =
            in.of(Quantity::rest) + group.first_value + static_cast<std::size_t>(run.items[i]) * group.parameters;
        std::copy_n(rest, group.parameters, own);
        const Rates<double> rates = rates_of(group, run.items[i]);
        at.evaluate(group.kind, own);
        for (int j = 0; j < group.rows; ++j) {
          T C = at.C[j];
          if (group.damped) C += T(rates.g) * at.kind->difference(C, T(p.potential.C_r[run.first_row[i] + j]));
          sum += T(0.5 * rates.scale / rates.a) * C * C;
          for (int d = 0; d < at.kind->dofs; ++d)
            if (node(d / 3) < row * p.block.movable)
              R[3 * (node(d / 3) / row) + d % 3] += at.J[j * at.kind->dofs + d] * C / T(rates.a);
        }
      }
    }
    if (phi) *phi = sum;
    return R;
  }
};

TEST(IncrementalPotential, HasTheForcesForItsGradient) {
  PotentialCase c;
  std::set<int> kinds;
  for (const DirectBlock& block : c.plan.blocks) {
    auto p = c.problem(block);
    std::vector<double> x(p.x.data(), p.x.data() + row * block.particles.size());
    for (const MemberRun& run : block.runs) kinds.insert(c.scene().groups[run.group].kind);
    double phi;
    const std::vector<double> R = c.residual(p, x, &phi);
    EXPECT_NEAR(p.potential.evaluate(block, p.x), phi, 1e-13 * phi);
    EXPECT_LE(relative_error(p.potential.R(), R), 1e-13);
    EXPECT_DOUBLE_EQ(
        p.potential.largest(),
        std::abs(*std::max_element(R.begin(), R.end(), [](double a, double b) { return std::abs(a) < std::abs(b); })));
    std::vector<double> along(x.size());
    for (int i = 0; i < 3 * block.movable; ++i) along[row * (i / 3) + i % 3] = c.random(-1.0, 1.0);
    const double slope = complex_step_along(
        [&](const std::vector<Complex>& z) {
          Complex at;
          c.residual(p, z, &at);
          return std::vector{at};
        },
        x, along)[0];
    double expected = 0.0, size = 0.0;
    for (int i = 0; i < 3 * block.movable; ++i) {
      expected += p.potential.R()[i] * along[row * (i / 3) + i % 3];
      size += std::abs(p.potential.R()[i]);
    }
    EXPECT_NEAR(slope, expected, 1e-12 * size);
  }
  for (int kind = 0; kind < kind_count; ++kind)
    with_kind(kind,
              [&]<class K>(K) { EXPECT_EQ(kinds.contains(kind), balances<K> && K::points == K::arity) << K::name; });
}

TEST(NewtonMatrix, IsTheDerivativeOfTheForces) {
  PotentialCase c;
  for (const DirectBlock& block : c.plan.blocks) {
    auto p = c.problem(block);
    NewtonMatrix matrix;
    matrix.resize(c.scene(), block);
    matrix.find(c.scene(), block, p.potential, p.x);
    Numbers<double> z, Kz;
    for (auto* rows : {&z, &Kz}) rows->assign(row * block.particles.size());
    std::vector<double> x(p.x.data(), p.x.data() + row * block.particles.size()), along(x.size());
    for (std::size_t i = 0; i < x.size(); ++i)
      if (i % row < 3) z[i] = along[i] = c.random(-1.0, 1.0);  // fixed particles too
    matrix.multiply(block, z, Kz);
    const auto expected =
        complex_step_along([&](const std::vector<Complex>& at) { return c.residual(p, at); }, x, along);
    std::vector<double> found(expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) found[i] = Kz[row * (i / 3) + i % 3];
    EXPECT_LE(relative_error(found, expected), 1e-12);

    // What is factored is that matrix.
    ASSERT_TRUE(matrix.factorize(c.scene(), block, 0.0));
    z.clear();
    std::vector<double> b = c.random.vector(expected.size()), solved = b;
    matrix.solve(block, solved.data());
    for (std::size_t i = 0; i < b.size(); ++i) z[row * (i / 3) + i % 3] = solved[i];
    matrix.multiply(block, z, Kz);
    for (std::size_t i = 0; i < b.size(); ++i) found[i] = Kz[row * (i / 3) + i % 3];
    EXPECT_LE(relative_error(found, b), 1e-9);
  }
}

TEST(PotentialKernels, GiveTheSameBitsOnEveryInstructionSet) {
  PotentialCase c;
  const DirectBlock& block = c.plan.blocks.front();
  auto p = c.problem(block);
  std::vector<std::vector<double>> all;
  for (const auto* kernels : available_kernels()) {
    auto arrays = p.potential.arrays(block, p.x);
    std::vector<Numbers<double>> elements(block.runs.size());
    std::vector<double*> numbers;
    std::vector<double> found;
    for (std::size_t r = 0; r < elements.size(); ++r) {
      elements[r].assign(block.runs[r].entries.size());
      numbers.push_back(elements[r].numbers());
    }
    arrays.elements = numbers.data();
    Numbers<double> Ez;
    Ez.assign(row * block.particles.size());
    found.push_back(kernels->potential->evaluate(arrays));
    kernels->potential->find_elements(arrays);
    kernels->potential->multiply(arrays, p.x.numbers(), Ez.numbers());
    for (const double* sums :
         std::initializer_list<const double*>{arrays.force, arrays.magnitude, arrays.stiffness, Ez.data()})
      found.insert(found.end(), sums, sums + row * block.particles.size());
    // Of members alone: lanes behind the last one are not read.
    for (std::size_t r = 0; r < elements.size(); ++r) {
      const auto& run = block.runs[r];
      const int numbers = triangle(3 * c.sample.scene.groups[run.group].arity);
      for (int i = 0; i < run.count; ++i)
        for (int e = 0; e < numbers; ++e) found.push_back(elements[r].data()[lane_at(i, numbers, e)]);
    }
    all.push_back(found);
  }
  for (const auto& found : all) EXPECT_TRUE(same_bits(found, all.front()));
}

}  // namespace
}  // namespace sheetbend::testing
