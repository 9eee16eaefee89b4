// The LDL^T of direct blocks against Eigen's dense solver, on chains, trees and loops; its cost must grow
// linearly.
#include "core/linear/symmetric_factor.h"

#include <Eigen/Dense>

#include "core/blocks/fours.h"
#include "core/element/small_ldlt.h"
#include "core/scalar/dual.h"
#include "core/scalar/pack.h"
#include "core/solver/plan.h"
#include "tests/cpp/support/compare.h"

namespace sheetbend::testing {
namespace {

using Entries = std::vector<std::pair<int, int>>;

struct Pattern {
  const char* name;
  bool banded;
  Entries (*entries)(int n);
};
void PrintTo(const Pattern& p, std::ostream* out) { *out << p.name; }

template <int Band>
Entries band(int n) {
  Entries e;
  for (int i = 0; i < n; ++i)
    for (int j = std::max(0, i - Band); j < i; ++j) e.emplace_back(i, j);
  return e;
}
Entries chain(int n) { return band<3>(n); }

// A binary tree with its leaves first, so that elimination fills nothing in.
Entries tree(int n) {
  Entries e;
  for (int i = 0; i + 1 < n; ++i) e.emplace_back(n - 1 - (n - 2 - i) / 2, i);
  return e;
}

Entries loop(int n) {
  Entries e{{n - 1, 0}};
  for (int i = 1; i < n; ++i) e.emplace_back(i, i - 1);
  return e;
}

// Entries in no order, some twice, that fill in.
Entries tangle(int n) {
  Entries e;
  Random random(n);
  for (int k = 0; k < 2 * n; ++k) {
    const int i = static_cast<int>(random(0, n)), j = static_cast<int>(random(0, n));
    if (i != j) e.emplace_back(std::max(i, j), std::min(i, j));
    if (i != j && k % 5 == 0) e.push_back(e.back());
  }
  return e;
}

// A grid whose nodes know two rings of neighbors, in an order that fills it in: supernodes as wide as they may be.
Entries sheet(int n) {
  const int side = static_cast<int>(std::ceil(std::sqrt(n)));
  const auto place = [n](int node) { return node * 37 % n; };
  Entries e;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j)
      if (std::abs(i / side - j / side) <= 2 && std::abs(i % side - j % side) <= 2)
        e.emplace_back(std::max(place(i), place(j)), std::min(place(i), place(j)));
  return e;
}

Eigen::MatrixXd random_matrix(int n, const Entries& entries, unsigned seed) {
  Random random(seed);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
  for (const auto& [i, j] : entries) A(i, j) = A(j, i) = random(-1.0, 1.0);
  for (int i = 0; i < n; ++i) A(i, i) = A.row(i).cwiseAbs().sum() + random(0.1, 1.0);
  return A;
}

// The factor of a matrix whose entries a function gives.
template <class T, class F>
Factor<T> factored(const FactorStructure& s, const Entries& entries, F&& entry) {
  Factor<T> factor;
  factor.reset(s);
  for (int i = 0; i < s.size(); ++i) factor.values[s.position(i, i)] = entry(i, i);
  for (const auto& [i, j] : entries) factor.values[s.position(i, j)] = entry(i, j);
  factor.factorize(s);
  return factor;
}

// The solution of a right side.
template <class T>
std::vector<T> solved(const FactorStructure& s, const Factor<T>& factor, std::vector<T> b) {
  b.resize(Factor<T>::right_side(s), T(0.0));
  factor.solve(s, b.data());
  b.resize(s.size());
  return b;
}

struct FactorOf : ::testing::TestWithParam<Pattern> {};
INSTANTIATE_TEST_SUITE_P(, FactorOf,
                         ::testing::Values(Pattern{"Chain", true, chain},
                                           Pattern{"BetweenUnrolledBands", true, band<7>},
                                           Pattern{"WideBand", true, band<20>}, Pattern{"Tree", false, tree},
                                           Pattern{"Loop", false, loop}, Pattern{"Tangle", false, tangle},
                                           Pattern{"Sheet", false, sheet}),
                         [](const auto& info) { return info.param.name; });

TEST_P(FactorOf, SolvesAsEigenDoes) {
  for (const int n : {50, 200}) {
    const Entries entries = GetParam().entries(n);
    const FactorStructure s(n, entries);
    EXPECT_EQ(s.banded(), GetParam().banded) << n;
    const Eigen::MatrixXd A = random_matrix(n, entries, n);
    const auto factor = factored<double>(s, entries, [&](int i, int j) { return A(i, j); });
    std::vector<double> b = Random(1).vector(n);
    const Eigen::VectorXd expected = A.partialPivLu().solve(Eigen::Map<Eigen::VectorXd>(b.data(), n));
    EXPECT_LE(relative_error(solved(s, factor, b), {expected.data(), static_cast<std::size_t>(n)}), 1e-13);
  }
}

TEST_P(FactorOf, CarriesTangents) {
  const int n = 60;
  const Entries entries = GetParam().entries(n);
  const FactorStructure s(n, entries);
  const Eigen::MatrixXd A = random_matrix(n, entries, 2), A_dot = random_matrix(n, entries, 3);
  const auto factor = factored<Dual<double, 1>>(s, entries, [&](int i, int j) {
    Dual<double, 1> a(A(i, j));
    a.d[0] = A_dot(i, j);
    return a;
  });
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(n, -1.0, 2.0), x = A.partialPivLu().solve(b);
  const Eigen::VectorXd x_dot = A.partialPivLu().solve(Eigen::VectorXd(-(A_dot * x)));
  std::vector<double> tangent;
  for (const auto& v : solved(s, factor, std::vector<Dual<double, 1>>(b.begin(), b.end()))) tangent.push_back(v.d[0]);
  EXPECT_LE(relative_error(tangent, {x_dot.data(), static_cast<std::size_t>(n)}), 1e-12);
}

TEST_P(FactorOf, HasTheSameBitsInEveryLane) {
  const int n = 60;
  const Entries entries = GetParam().entries(n);
  const FactorStructure s(n, entries);
  std::vector<Eigen::MatrixXd> A;
  for (int lane = 0; lane < Pack::lanes; ++lane) A.push_back(random_matrix(n, entries, lane));
  const auto packed =
      factored<Pack>(s, entries, [&](int i, int j) { return per_lane([&](int lane) { return A[lane](i, j); }); });
  const auto x = solved(s, packed, std::vector<Pack>(n, Pack(1.0)));
  for (int lane = 0; lane < Pack::lanes; ++lane) {
    const auto scalar = solved(s, factored<double>(s, entries, [&](int i, int j) { return A[lane](i, j); }),
                               std::vector<double>(n, 1.0));
    std::vector<double> of_lane;
    for (const Pack& v : x) of_lane.push_back(v[lane]);
    EXPECT_TRUE(same_bits(of_lane, scalar)) << "lane " << lane;
  }
}

// A row of zeros (a rigid constraint of which nothing can move) gets the solution zero and disturbs no other.
TEST_P(FactorOf, RowsOfZerosGetZero) {
  const int n = 50;
  const Entries entries = GetParam().entries(n);
  const FactorStructure s(n, entries);
  Eigen::MatrixXd A = random_matrix(n, entries, 4), regular = A;
  for (const int k : {0, 17, n - 1}) {
    A.row(k).setZero(), A.col(k).setZero();
    regular.row(k).setZero(), regular.col(k).setZero();
    regular(k, k) = 1.0;
  }
  Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(n, 1.0, 2.0);
  const auto x = solved(s, factored<double>(s, entries, [&](int i, int j) { return A(i, j); }),
                        std::vector<double>(b.begin(), b.end()));
  for (const int k : {0, 17, n - 1}) b[k] = 0.0;
  const Eigen::VectorXd expected = regular.partialPivLu().solve(b);
  for (const int k : {0, 17, n - 1}) EXPECT_EQ(x[k], 0.0) << "row " << k;
  EXPECT_LE(relative_error(x, {expected.data(), static_cast<std::size_t>(n)}), 1e-13);
}

// A row that follows from those before it has a pivot of rounding alone. It gets the solution zero, and the others what they have without it.
TEST_P(FactorOf, RedundantRowsGetZero) {
  const int n = 50;
  const Entries entries = GetParam().entries(n);
  const FactorStructure s(n, entries, true, redundant_pivot);
  for (const double scale : {1e-6, 1.0, 1e9}) {
    Eigen::MatrixXd A = scale * random_matrix(n, entries, 6);
    const std::vector<int> redundant{18, 31, n - 1};
    Eigen::MatrixXd rest = A;
    for (const int k : redundant) {
      const Eigen::VectorXd column = rest.col(k).head(k);
      A(k, k) = column.dot(rest.topLeftCorner(k, k).partialPivLu().solve(column));
      rest.row(k).setZero(), rest.col(k).setZero();
      rest(k, k) = scale;
    }
    Eigen::VectorXd b = scale * Eigen::VectorXd::LinSpaced(n, 1.0, 2.0);
    const auto x = solved(s, factored<double>(s, entries, [&](int i, int j) { return A(i, j); }),
                          std::vector<double>(b.begin(), b.end()));
    for (const int k : redundant) b[k] = 0.0;
    const Eigen::VectorXd expected = rest.partialPivLu().solve(b);
    for (const int k : redundant) EXPECT_EQ(x[k], 0.0) << "row " << k;
    EXPECT_LE(relative_error(x, {expected.data(), static_cast<std::size_t>(n)}), 1e-12) << scale;
  }
}

// Also with rows of zeros, at the ends and inside.
TEST(Factor, ByFoursHasTheSameBits) {
  constexpr int band = 10;
  for (const int n : {1, 9, 11, 60}) {
    const FactorStructure s(n, testing::band<band>(n));
    Eigen::MatrixXd A = random_matrix(n, testing::band<band>(n), n);
    for (const int k : {0, 5, n - 1})
      if (n > 20) A.row(k).setZero(), A.col(k).setZero();
    std::vector<double> values((n + band) * (band + 1) + band_padding), inverse(n + band);
    for (int j = 0; j < n; ++j)
      for (int i = j; i < std::min(n, j + band + 1); ++i) values[(band + j) * (band + 1) + i - j] = A(i, j);
    auto fours = values, fours_inverse = inverse;
    factorize_band<band>(n, band, values.data(), inverse.data());
    factorize_band_by_fours<band>(n, fours.data(), fours_inverse.data());
    EXPECT_TRUE(same_bits(fours, values)) << n;
    EXPECT_TRUE(same_bits(fours_inverse, inverse)) << n;
  }
}

TEST(Factor, CanBeUsedAgain) {
  const int n = 50;
  const Entries entries = tree(n);
  const FactorStructure s(n, entries);
  Factor<double> factor = factored<double>(s, entries, [&](int i, int j) { return i == j ? 9.0 : 1.0; });
  const auto first = solved(s, factor, std::vector<double>(n, 1.0));
  factor.reset(s);
  for (int i = 0; i < n; ++i) factor.values[s.position(i, i)] = 9.0;
  for (const auto& [i, j] : entries) factor.values[s.position(i, j)] = 1.0;
  factor.factorize(s);
  EXPECT_TRUE(same_bits(first, solved(s, factor, std::vector<double>(n, 1.0))));
}

TEST(Factor, SplitsWideSupernodes) {
  const FactorStructure s(200, sheet(200));
  EXPECT_EQ(s.supernodes().widest, 30);
  EXPECT_LT(s.supernodes().count, 50);
}

TEST(Factor, RefusesEntriesOutsideItsPattern) {
  const FactorStructure s(50, tree(50));
  EXPECT_THROW(s.position(20, 1), std::logic_error);
}

TEST(FactorCost, GrowsLinearly) {
  for (const int n : {100, 200, 400, 800}) {
    EXPECT_EQ(FactorStructure(n, chain(n)).fill(), 4u * n);
    EXPECT_EQ(FactorStructure(n, tree(n)).fill(), n - 1u);
    EXPECT_EQ(FactorStructure(n, loop(n)).fill(), 2u * n - 3);
  }
}

// The same through a scene: the plan's own ordering has to find the linear cost.
std::size_t fill_of(int particles, const std::vector<int>& pairs) {
  SceneSpec spec;
  spec.particles = particles;
  spec.groups = {{"links", "distance", false, pairs}};
  const Plan plan = make_plan(build_scene(spec), {.partition = Partition::direct});
  EXPECT_EQ(plan.blocks.size(), 1u);
  return plan.blocks.at(0).structure.fill();
}

TEST(FactorCost, GrowsLinearlyOverRopesRingsAndTrees) {
  const auto rope = [](int n) {
    std::vector<int> pairs;
    for (int i = 0; i + 1 < n; ++i) pairs.insert(pairs.end(), {i, i + 1});
    return fill_of(n, pairs);
  };
  const auto ring = [](int n) {
    std::vector<int> pairs{n - 1, 0};
    for (int i = 0; i + 1 < n; ++i) pairs.insert(pairs.end(), {i, i + 1});
    return fill_of(n, pairs);
  };
  const auto branches = [](int n) {
    std::vector<int> pairs;
    for (int i = 1; i < n; ++i) pairs.insert(pairs.end(), {(i - 1) / 2, i});
    return fill_of(n, pairs);
  };
  for (const int n : {100, 200, 400}) {
    EXPECT_LE(rope(n), 2u * n);
    EXPECT_LE(ring(n), 4u * n);
    EXPECT_LE(branches(n), 3u * n);
  }
}

TEST(SmallLdlt, LeavesRedundantRowsOut) {
  Eigen::Matrix<double, 3, 2> J;
  J << 1.0, 0.3, -0.2, 2.0, 0.7, 1.9;
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> A = 1e3 * J * J.transpose();
  Eigen::Vector3d b(1.0, -2.0, 0.5), x = b;
  SmallLdlt<3, double>(A.data(), redundant_pivot).solve(x.data());
  EXPECT_EQ(x[2], 0.0);
  EXPECT_LE((A * x - b).head(2).norm(), 1e-12);
}

TEST(SmallLdlt, SolvesAsEigenDoesAndSkipsZeroRows) {
  Random random(5);
  for (int repetition = 0; repetition < 20; ++repetition) {
    Eigen::Matrix<double, 3, 3, Eigen::RowMajor> M, A;
    for (int i = 0; i < 9; ++i) M.data()[i] = random(-1.0, 1.0);
    A = M * M.transpose() + 0.1 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d b(1.0, -2.0, 0.5), x = b;
    SmallLdlt<3, double>(A.data()).solve(x.data());
    EXPECT_LE((A * x - b).norm(), 1e-13);

    A.row(1).setZero(), A.col(1).setZero();
    x = b;
    SmallLdlt<3, double>(A.data()).solve(x.data());
    EXPECT_EQ(x[1], 0.0);
    EXPECT_NEAR(A.row(0) * x, b[0], 1e-13);
    EXPECT_NEAR(A.row(2) * x, b[2], 1e-13);
  }
}

}  // namespace
}  // namespace sheetbend::testing
