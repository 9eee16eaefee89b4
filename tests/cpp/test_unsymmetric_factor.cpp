// The LU of implicit blocks with sliding contacts against Eigen's dense one, on chains, trees, tangles and sheets of particles.
#include "core/linear/unsymmetric_factor.h"

#include <Eigen/Dense>

#include "core/packs/packed_colors.h"
#include "core/scalar/dual.h"
#include "tests/cpp/support/compare.h"

namespace sheetbend::testing {
namespace {

using Pairs = std::vector<std::pair<int, int>>;  // of particles, row >= column

struct Pattern {
  const char* name;
  int particles;
  Pairs (*pairs)(int n);
};
void PrintTo(const Pattern& p, std::ostream* out) { *out << p.name; }

Pairs apart(int) { return {}; }

Pairs chain(int n) {
  Pairs p;
  for (int i = 1; i < n; ++i) p.emplace_back(i, i - 1);
  return p;
}

Pairs tree(int n) {
  Pairs p;
  for (int i = 0; i + 1 < n; ++i) p.emplace_back(n - 1 - (n - 2 - i) / 2, i);
  return p;
}

Pairs tangle(int n) {
  Pairs p;
  Random random(n);
  for (int k = 0; k < 2 * n; ++k) {
    const int i = static_cast<int>(random(0, n)), j = static_cast<int>(random(0, n));
    if (i != j) p.emplace_back(std::max(i, j), std::min(i, j));
  }
  return p;
}

// A grid in an order that fills it in: supernodes as wide as they may be.
Pairs sheet(int n) {
  const int side = static_cast<int>(std::ceil(std::sqrt(n)));
  const auto place = [n](int node) { return node * 37 % n; };
  Pairs p;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j)
      if (std::abs(i / side - j / side) <= 1 && std::abs(i % side - j % side) <= 1)
        p.emplace_back(std::max(place(i), place(j)), std::min(place(i), place(j)));
  return p;
}

FactorStructure structure_of(int particles, Pairs pairs) {
  for (int i = 0; i < particles; ++i) pairs.emplace_back(i, i);
  std::vector<std::pair<int, int>> entries;
  for (const auto& [i, j] : pairs)
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < (i == j ? a + 1 : 3); ++b) entries.emplace_back(3 * i + a, 3 * j + b);
  return FactorStructure(3 * particles, entries, false);
}

// A matrix with its factor: a symmetric part, and blocks of it that are not.
struct Case {
  FactorStructure structure;
  Eigen::MatrixXd A;
  UnsymmetricFactor factor;

  Case(int particles, const Pairs& pairs, unsigned seed)
      : structure(structure_of(particles, pairs)), A(Eigen::MatrixXd::Zero(structure.size(), structure.size())) {
    Random random(seed);
    std::vector<double> values(structure.values());
    const auto put = [&](int row, int column, double a) {
      A(row, column) = A(column, row) = values[structure.position(row, column)] = a;
    };
    for (const auto& [i, j] : pairs)
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) put(3 * i + a, 3 * j + b, random(-1.0, 1.0));
    for (int d = 0; d < structure.size(); ++d) put(d, d, 2.0 * A.row(d).cwiseAbs().sum() + random(4.0, 6.0));
    factor.resize(structure);
    factor.load(structure, values.data());
    for (const auto& [i, j] : pairs) {
      add(i, j, random.vector(9));
      add(j, i, random.vector(9));
    }
    for (int i = 0; i < particles; ++i) add(i, i, random.vector(9));
  }

  void add(int i, int j, const std::vector<double>& block) {
    constexpr double scale = 0.75;
    factor.add(structure, 3 * i, 3 * j, scale, block.data());
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) A(3 * i + a, 3 * j + b) += scale * block[3 * a + b];
  }

  // Turns the diagonal block of a particle, so that its diagonal is far smaller than the rest.
  void turn(int particle, double left) {
    const Eigen::Matrix3d D = A.block<3, 3>(3 * particle, 3 * particle);
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        A(3 * particle + a, 3 * particle + b) = (a + 1) % 3 == b ? D(b, b) : a == b ? left : D(a, b);
    load();
  }

  // The factor's numbers are those of A again.
  void load() {
    factor.load(structure, std::vector<double>(structure.values()).data());
    for (int i = 0; i < structure.size(); i += 3)
      for (int j = 0; j < structure.size(); j += 3) {
        const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> block = A.block<3, 3>(i, j);
        if ((block.array() != 0.0).any()) factor.add(structure, i, j, 1.0, block.data());
      }
  }
};

Eigen::VectorXd right_side(int n) { return Eigen::VectorXd::LinSpaced(n, -1.0, 2.0); }

double apart_from(const std::vector<double>& found, const Eigen::VectorXd& expected) {
  return relative_error(found, {expected.data(), static_cast<std::size_t>(expected.size())});
}

struct UnsymmetricFactorOf : ::testing::TestWithParam<Pattern> {};
INSTANTIATE_TEST_SUITE_P(, UnsymmetricFactorOf,
                         ::testing::Values(Pattern{"One", 1, apart}, Pattern{"Apart", 12, apart},
                                           Pattern{"Chain", 60, chain}, Pattern{"Tree", 60, tree},
                                           Pattern{"Tangle", 60, tangle}, Pattern{"SmallSheet", 25, sheet},
                                           Pattern{"Sheet", 100, sheet}),
                         [](const auto& info) { return info.param.name; });

TEST_P(UnsymmetricFactorOf, SolvesBothWaysAsEigenDoes) {
  for (const bool turned : {false, true}) {
    const auto& [name, particles, pairs] = GetParam();
    Case c(particles, pairs(particles), 3);
    if (turned)
      for (int p = 0; p < particles; ++p) c.turn(p, p % 2 == 0 ? 0.0 : 1e-9);
    ASSERT_TRUE(c.factor.factorize(c.structure));
    const Eigen::VectorXd b = right_side(c.structure.size()), x = c.A.partialPivLu().solve(b),
                          other = c.A.transpose().partialPivLu().solve(b);
    std::vector<double> z(b.begin(), b.end()), transposed = z;
    c.factor.solve(c.structure, z.data());
    c.factor.solve_transposed(c.structure, transposed.data());
    EXPECT_LE(apart_from(z, x), 1e-13) << turned;
    EXPECT_LE(apart_from(transposed, other), 1e-13) << turned;
    EXPECT_GT((x - other).norm(), 1e-3 * x.norm());
  }
}

// Of duals the value and each tangent are solved for, with the same bits for the value as a double has.
TEST_P(UnsymmetricFactorOf, SolvesForDuals) {
  const auto& [name, particles, pairs] = GetParam();
  Case c(particles, pairs(particles), 5);
  ASSERT_TRUE(c.factor.factorize(c.structure));
  const int n = c.structure.size();
  for (const bool transposed : {false, true}) {
    const auto solve = [&](auto& b) {
      if (transposed)
        c.factor.solve_transposed(c.structure, b.data());
      else
        c.factor.solve(c.structure, b.data());
    };
    std::vector<double> value = Random(1).vector(n), tangent = Random(2).vector(n);
    std::vector<Dual<double, 2>> both(value.begin(), value.end());
    for (int i = 0; i < n; ++i) both[i].d[0] = tangent[i], both[i].d[1] = -2.0 * tangent[i];
    solve(value), solve(tangent), solve(both);
    for (int i = 0; i < n; ++i) {
      EXPECT_EQ(both[i].v, value[i]);
      EXPECT_NEAR(both[i].d[0], tangent[i], 1e-15);
      EXPECT_EQ(both[i].d[1], -2.0 * both[i].d[0]);
    }
  }
}

TEST_P(UnsymmetricFactorOf, HasTheSameBitsOnEveryInstructionSet) {
  const auto& [name, particles, pairs] = GetParam();
  std::vector<std::vector<double>> solutions;
  for (const auto* kernels : available_kernels()) {
    Case c(particles, pairs(particles), 8);
    c.turn(0, 0.0);
    ASSERT_TRUE(c.factor.factorize(c.structure, kernels->factor_unsymmetric));
    solutions.push_back(std::vector<double>(c.structure.size(), 1.0));
    c.factor.solve(c.structure, solutions.back().data());
    EXPECT_TRUE(same_bits(solutions.back(), solutions.front())) << kernels->name;
  }
}

TEST(UnsymmetricFactor, CanBeUsedAgain) {
  Case c(40, tangle(40), 2);
  std::vector<double> first(c.structure.size(), 1.0), again = first;
  for (auto* x : {&first, &again}) {
    c.load();
    ASSERT_TRUE(c.factor.factorize(c.structure));
    c.factor.solve(c.structure, x->data());
  }
  EXPECT_TRUE(same_bits(again, first));
}

TEST(UnsymmetricFactor, SaysWhereThereIsNoInverse) {
  for (const int row : {0, 61, 89}) {
    Case c(30, sheet(30), 2);
    c.A.row(row).setZero();
    c.load();
    EXPECT_FALSE(c.factor.factorize(c.structure)) << row;
    c.A(row, row) = std::numeric_limits<double>::quiet_NaN();
    c.load();
    EXPECT_FALSE(c.factor.factorize(c.structure)) << row;
  }
}

TEST(UnsymmetricFactor, RefusesSupernodesThatEndWithinAParticle) {
  const FactorStructure single(4, {{2, 1}}, false);
  UnsymmetricFactor factor;
  EXPECT_THROW(factor.resize(single), std::logic_error);
}

}  // namespace
}  // namespace sheetbend::testing
