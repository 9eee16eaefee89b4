// The two levels of conjugate gradients: aggregates of neighbors, products and sweeps by blocks, what rigid bodies take off a residual.
#include "core/linear/aggregation.h"

#include <map>
#include <set>

#include "core/element/small_ldlt.h"
#include "core/linear/block_matrix.h"
#include "core/linear/coarse_level.h"
#include "core/linear/conjugate_gradients.h"
#include "tests/cpp/support/compare.h"

namespace sheetbend::testing {
namespace {

// Links of two particles each.
CondensedShares links(const std::vector<std::pair<int, int>>& pairs) {
  CondensedShares shares;
  for (const auto& [i, j] : pairs) {
    const int use = static_cast<int>(shares.dofs.size());
    shares.members.push_back({use / 2, 1, use, 2});
    shares.dofs.insert(shares.dofs.end(), {3 * i, 3 * j});
    shares.gradients.insert(shares.gradients.end(), {4 * use, 4 * use + 4});
  }
  return shares;
}

// A sheet of n x n particles: links along rows and columns, and across the cells both ways.
std::vector<std::pair<int, int>> sheet(int n) {
  std::vector<std::pair<int, int>> pairs;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const int at = n * i + j;
      if (j + 1 < n) pairs.emplace_back(at, at + 1);
      if (i + 1 < n) pairs.emplace_back(at, at + n);
      if (i + 1 < n && j + 1 < n) pairs.insert(pairs.end(), {{at, at + n + 1}, {at + 1, at + n}});
    }
  return pairs;
}

std::map<int, std::set<int>> aggregates(const Aggregation& a) {
  std::map<int, std::set<int>> sets;
  for (int i = 0; i < static_cast<int>(a.dof_of.size()); ++i) sets[a.dof_of[i]].insert(i);
  return sets;
}

TEST(Aggregation, JoinsNeighbors) {
  for (const int n : {2, 7, 20}) {
    const Aggregation a(n * n, links(sheet(n)));
    const auto sets = aggregates(a);
    EXPECT_EQ(static_cast<int>(sets.size()), a.aggregates());
    for (const auto& [dof, set] : sets) {
      EXPECT_EQ(dof % Aggregation::modes, 0);
      const int first = *set.begin(), last = *set.rbegin();
      EXPECT_LE(last / n - first / n, 4);
    }
    EXPECT_GE(n * n, 4 * a.aggregates());
  }
}

TEST(Aggregation, TakesChainsByThreeAndSingleParticlesAlone) {
  const Aggregation chain(9, links({{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 5}, {5, 6}, {6, 7}, {7, 8}}));
  EXPECT_LE(chain.aggregates(), 4);
  CondensedShares anchored;  // to a fixed node
  anchored.members = {{0, 1, 0, 1}};
  anchored.dofs = {0};
  anchored.gradients = {0};
  const Aggregation alone(1, std::move(anchored));
  EXPECT_EQ(alone.aggregates(), 1);
  EXPECT_EQ(alone.column, std::vector<int>{0});
}

// H of a sheet of springs between particles of mass one, by blocks.
template <class T>
struct SheetOfSprings {
  Aggregation plan;
  std::vector<double> x;  // in space
  std::vector<T> blocks, inverse;
  CoarseLevel<T> coarse;

  SheetOfSprings(int n, const T& stiffness) : plan(n * n, links(sheet(n))), blocks(9 * plan.column.size(), T(0.0)) {
    for (int i = 0; i < n * n; ++i) x.insert(x.end(), {1.0 * (i / n), 1.0 * (i % n), 0.2 * std::sin(0.5 * (i / n))});
    for (int i = 0; i < n * n; ++i)
      for (int d = 0; d < 3; ++d) block(i, i)[4 * d] = T(1.0);
    for (const auto& [i, j] : sheet(n)) {
      const Vec3<double> edge = Vec3<double>(&x[3 * j]) - Vec3<double>(&x[3 * i]);
      const double along[3] = {edge.x, edge.y, edge.z};
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) {
          const T k = stiffness * T(along[a] * along[b] / dot(edge, edge));
          block(i, i)[3 * a + b] += k;
          block(j, j)[3 * a + b] += k;
          block(std::max(i, j), std::min(i, j))[3 * a + b] -= k;
        }
    }
    for (int i = 0; i < n * n; ++i) {
      const SmallLdlt<3, T> factor(block(i, i));
      for (int a = 0; a < 3; ++a) {
        T column[3] = {T(0.0), T(0.0), T(0.0)};
        column[a] = T(1.0);
        factor.solve(column);
        inverse.insert(inverse.end(), column + a, column + 3);
      }
    }
    coarse.factorize(plan, blocks.data(), [&](std::size_t i, int d) { return T(x[3 * i + d]); }, nullptr);
  }

  T* block(int i, int j) {
    const auto row = plan.column.begin() + plan.start[i];
    return &blocks[9 * (std::lower_bound(row, plan.column.begin() + plan.start[i + 1], j) - plan.column.begin())];
  }
  BlockMatrix<T> matrix() const {
    return {plan.start.data(), plan.column.data(), blocks.data(), inverse.data(), static_cast<int>(plan.dof_of.size())};
  }
  void multiply(const T* p, T* q) const { matrix().multiply(p, q); }
  void precondition(const T* r, T* z) const {
    std::vector<T> rest(x.size()), room(CoarseLevel<T>::work(plan));
    matrix().sweep_forward(r, z, rest.data());
    coarse.correct(plan, rest.data(), z, room.data());
    matrix().sweep_backward(r, z, rest.data());
  }
};

template <class T>
T product(const std::vector<T>& a, const std::vector<T>& b) {
  return dot_product(a.data(), b.data(), a.size());
}

TEST(BlockMatrix, SweepsSolveTheirTriangles) {
  const SheetOfSprings<double> sheet(5, 30.0);
  Random random(1);
  const std::vector<double> r = random.vector(75);
  std::vector<double> z(75), rest(75), q(75), later(75);
  sheet.matrix().sweep_forward(r.data(), z.data(), rest.data());
  sheet.multiply(z.data(), q.data());
  for (int d = 0; d < 75; ++d) EXPECT_NEAR(rest[d], r[d] - q[d], 1e-13);
  for (int d = 72; d < 75; ++d) EXPECT_NEAR(rest[d], 0.0, 1e-13);  // the last row's
  sheet.matrix().sweep_backward(r.data(), z.data(), later.data());
  sheet.multiply(z.data(), q.data());
  for (int d = 0; d < 3; ++d) EXPECT_NEAR(q[d], r[d], 1e-13);  // the first row's
}

// So that conjugate gradients may use it.
TEST(TwoLevels, AreSymmetricAndPositive) {
  const SheetOfSprings<double> sheet(9, 1e4);
  Random random(2);
  const auto through = [&](const std::vector<double>& r) {
    std::vector<double> z(r.size());
    sheet.precondition(r.data(), z.data());
    return z;
  };
  for (int i = 0; i < 5; ++i) {
    const std::vector<double> r = random.vector(243), s = random.vector(243);
    EXPECT_NEAR(product(s, through(r)), product(r, through(s)), 1e-11 * std::abs(product(s, through(s))));
    EXPECT_GT(product(r, through(r)), 0.0);
  }
}

// What moves every aggregate as a rigid body is found at once, whatever else is there.
TEST(TwoLevels, LeaveNoRigidBody) {
  SheetOfSprings<double> sheet(9, 10.0);
  const std::size_t size = sheet.x.size();
  std::vector<double> z(size), r(size), found(size, 0.0), room(CoarseLevel<double>::work(sheet.plan));
  for (std::size_t i = 0; i < size; i += 3) {
    const Vec3<double> turn = cross(Vec3<double>(0.3, -0.2, 0.5), Vec3<double>(&sheet.x[i]));
    (Vec3<double>(1.0, 2.0, -1.0) + turn).store(&z[i]);
  }
  sheet.multiply(z.data(), r.data());
  sheet.coarse.correct(sheet.plan, r.data(), found.data(), room.data());
  EXPECT_LE(relative_error(found, z), 1e-9);
}

int iterations(int n, double stiffness) {
  const SheetOfSprings<double> sheet(n, stiffness);
  Random random(3);
  std::vector<double> b = random.vector(static_cast<int>(sheet.x.size())), work(3 * b.size());
  return conjugate_gradients(sheet, n * n, {1e-12, 1000}, b.data(), work.data());
}

TEST(TwoLevels, TakeAsManyIterationsOnFinerSheets) {
  const int coarse = iterations(12, 1e4), fine = iterations(48, 1e4);
  EXPECT_GT(coarse, 10);
  EXPECT_LT(fine, 2 * coarse);
  EXPECT_LT(fine, 80);
}

// Every lane has a matrix, a coarse factor and a right side of its own.
TEST(TwoLevels, LanesHaveTheBitsThatTheyHaveAlone) {
  const auto stiffness = [](int lane) { return std::pow(10.0, lane - 2); };
  const SheetOfSprings<Pack> together(7, per_lane(stiffness));
  Random random(4);
  const std::vector<double> r = random.vector(147);
  std::vector<Pack> z(147);
  together.precondition(std::vector<Pack>(r.begin(), r.end()).data(), z.data());
  for (int lane = 0; lane < Pack::lanes; ++lane) {
    std::vector<double> alone(147), own;
    SheetOfSprings<double>(7, stiffness(lane)).precondition(r.data(), alone.data());
    for (const Pack& a : z) own.push_back(a[lane]);
    EXPECT_TRUE(same_bits(own, alone)) << "lane " << lane;
  }
}

}  // namespace
}  // namespace sheetbend::testing
