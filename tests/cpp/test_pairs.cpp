// Pairs that touch: distances against a search over their points, forces against the potential, and which pairs are found.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "adjoint/solver/block_pairs_vjp.h"
#include "core/contact/box_grid.h"
#include "core/contact/find_pairs.h"
#include "core/contact/meeting.h"
#include "core/scalar/complex.h"

namespace sheetbend::testing {
namespace {

using Coordinates = std::array<double, 12>;

std::mt19937& random() {
  static std::mt19937 engine(7);
  return engine;
}
double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random()); }

Coordinates somewhere() {
  Coordinates x;
  for (double& a : x) a = uniform(-1.0, 1.0);
  return x;
}

// The least of what nearest.h says, over a fine grid of places.
double searched(bool triangle, const double* x, double softness) {
  constexpr int n = 200;
  double least = 1e300;
  for (int i = 0; i <= n; ++i)
    for (int k = 0; k <= (triangle ? n - i : n); ++k) {
      const double s = static_cast<double>(i) / n, t = static_cast<double>(k) / n;
      double squared = 0.0;
      if (triangle) {
        for (int d = 0; d < 3; ++d) {
          const double a = x[d] - (1.0 - s - t) * x[3 + d] - s * x[6 + d] - t * x[9 + d];
          squared += a * a;
        }
      } else {
        squared = segments_at(x, softness, s, t).squared;
      }
      least = std::min(least, squared);
    }
  return least;
}

TEST(Pairs, AreAsFarApartAsTheirNearestPoints) {
  int inside = 0, edges = 0, corners = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const bool triangle = trial % 2;
    const Coordinates x = somewhere();
    const double softness = 1e-2;
    const Part part = nearest_part(triangle, x.data(), softness);
    const double squared = nearest_points(triangle, x.data(), softness, part).squared;
    const double found = searched(triangle, x.data(), softness);
    EXPECT_LE(squared, found + 1e-12);
    EXPECT_NEAR(squared, found, 1e-2 * (0.05 + found)) << trial;
    (part.first < 0 && (triangle || part.second < 0)    ? inside
     : part.second < 0 || (!triangle && part.first < 0) ? edges
                                                        : corners) += 1;
  }
  EXPECT_GT(inside, 50);
  EXPECT_GT(edges, 50);
  EXPECT_GT(corners, 50);
}

// Segments that lie side by side touch at the middle of what is beside each other, and a tilt moves that place only little.
TEST(Pairs, TouchInTheMiddleOfParallelSegments) {
  const double touching = 0.02, softness = segment_softness * touching * touching;
  Coordinates x{0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.5, 0.0, 0.02, 1.5, 0.0, 0.02};
  const auto place = [&] {
    return nearest_points(false, x.data(), softness, nearest_part(false, x.data(), softness)).weight[1];
  };
  EXPECT_NEAR(place(), 0.75, 1e-5);
  x[11] += 1e-9;
  EXPECT_NEAR(place(), 0.75, 1e-4);
}

template <class T>
constexpr const Rub<T>* smooth = nullptr;

TEST(Pairs, PushAlongTheGradientOfTheirPotentialAndKeepMomentum) {
  int pushed = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const bool triangle = trial % 2;
    Coordinates x = somewhere();
    for (double& a : x) a *= 0.5;
    const PairNumbers<double> numbers{0.6, 3.0};
    const Part part = nearest_part(triangle, x.data(), softness_of(numbers));
    double force[12], E[144];
    const double depth = meet(triangle, part, x.data(), numbers, smooth<double>, force).depth;
    if (!(depth > 0.0)) continue;
    ++pushed;
    meeting_matrix(triangle, part, x.data(), numbers, smooth<double>, E);
    double scale = 0.0;
    for (const double f : force) scale = std::max(scale, std::abs(f));
    for (int i = 0; i < 12; ++i) {
      Complex moved[12], own[12];
      for (int d = 0; d < 12; ++d) moved[d] = Complex(x[d]);
      moved[i].im = 1e-30;
      // The potential of the same part: the derivative leaves out that of the weights.
      const PairNumbers<Complex> n{Complex(numbers.touching), Complex(numbers.kappa)};
      const Complex deep = meet(triangle, part, moved, n, smooth<Complex>, own).depth;
      EXPECT_NEAR(-(numbers.kappa * depth * deep.im / 1e-30), force[i], 1e-10 * scale) << trial;
      for (int k = 0; k < 12; ++k) {
        EXPECT_NEAR(E[12 * k + i], -own[k].im / 1e-30, 1e-9 * (1.0 + std::abs(E[12 * k + i])));
        EXPECT_NEAR(E[12 * k + i], E[12 * i + k], 1e-9 * (1.0 + std::abs(E[12 * k + i])));
      }
    }
    Vec3<double> sum(0.0, 0.0, 0.0), moment = sum;
    for (int k = 0; k < 4; ++k) {
      const Vec3<double> f(force + 3 * k), at(&x[3 * k]);
      sum = sum + f;
      moment = moment + cross(at, f);
    }
    EXPECT_LE(norm(sum), 1e-13 * scale);
    EXPECT_LE(norm(moment), 1e-12 * scale);
  }
  EXPECT_GT(pushed, 100);
}

// All that a pair with friction reads: coordinates (12), D, kappa, the coefficient, what is carried (3) and where slip is counted from (12).
template <class T>
Meeting<T> rubbed(bool triangle, Part part, const std::vector<T>& a, T* force) {
  Rub<T> rub{a[14], Vec3<T>(&a[15]), {}};
  std::copy_n(&a[18], 12, rub.from);
  return meet(triangle, part, a.data(), {a[12], a[13]}, &rub, force);
}

// Its matrix and its reverse are those of complex steps, whether it sticks or slides. It keeps momentum, and turns the pair by its couple alone.
TEST(Pairs, RubAgainstEachOther) {
  int slid = 0, stuck = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const bool triangle = trial % 2;
    Coordinates x = somewhere();
    for (double& a : x) a *= 0.5;
    std::vector<double> a(x.begin(), x.end());
    a.insert(a.end(), {0.6, 3.0, 0.4, 0.02, -0.03, 0.01});
    const Coordinates aside = somewhere();
    for (int d = 0; d < 12; ++d) a.push_back(x[d] + 0.05 * aside[d]);
    const PairNumbers<double> numbers{a[12], a[13]};
    const Part part = nearest_part(triangle, x.data(), softness_of(numbers));
    double force[12], plain[12], E[144];
    const auto met = rubbed(triangle, part, a, force);
    if (!(met.depth > 0.0)) continue;
    (met.slides ? slid : stuck) += 1;
    Rub<double> rub{a[14], Vec3<double>(&a[15]), {}}, rub_bar;
    std::copy_n(&a[18], 12, rub.from);
    meeting_matrix(triangle, part, x.data(), numbers, &rub, E);
    meet(triangle, part, x.data(), numbers, smooth<double>, plain);

    const Coordinates along = somewhere();
    const Vec3<double> tangential_bar(0.7, -0.4, 1.1);
    double x_bar[12], same[12];
    const auto numbers_bar =
        rub_vjp(triangle, part, x.data(), numbers, rub, along.data(), tangential_bar, x_bar, same, rub_bar);
    std::vector<double> bar(x_bar, x_bar + 12);
    bar.insert(bar.end(), {numbers_bar.touching, numbers_bar.kappa, rub_bar.friction, rub_bar.carried.x,
                           rub_bar.carried.y, rub_bar.carried.z});
    bar.insert(bar.end(), rub_bar.from, rub_bar.from + 12);
    double scale = 0.0;
    for (const double b : bar) scale = std::max(scale, std::abs(b));
    for (std::size_t i = 0; i < a.size(); ++i) {
      std::vector<Complex> moved(a.begin(), a.end());
      moved[i].im = 1e-30;
      Complex own[12];
      const auto found = rubbed(triangle, part, moved, own);
      double sum =
          dot(tangential_bar, Vec3<double>(found.tangential.x.im, found.tangential.y.im, found.tangential.z.im));
      for (int d = 0; d < 12; ++d) sum += along[d] * own[d].im;
      EXPECT_NEAR(bar[i], sum / 1e-30, 1e-10 * scale) << trial << ", " << i;
      for (int k = 0; k < 12 && i < 12; ++k)
        EXPECT_NEAR(E[12 * k + i], -own[k].im / 1e-30, 1e-9 * (1.0 + std::abs(E[12 * k + i])));
    }

    const Nearest<double> n = nearest_points(triangle, x.data(), softness_of(numbers), part);
    Vec3<double> sum(0.0, 0.0, 0.0), moment = sum - cross(n.apart, met.tangential);
    double largest = 0.0;
    for (int k = 0; k < 4; ++k) {
      const Vec3<double> f(force + 3 * k), at(&x[3 * k]);
      sum = sum + f;
      moment = moment + cross(at, f);
      largest = std::max(largest, norm(f));
    }
    EXPECT_LE(norm(sum), 1e-13 * largest);
    EXPECT_LE(norm(moment), 1e-12 * largest);
    EXPECT_LE(std::abs(dot(met.tangential, n.apart)), 1e-12 * largest);
    Vec3<double> pushed(plain);  // the first side
    if (!triangle) pushed = pushed + Vec3<double>(plain + 3);
    const double push = norm(pushed);
    EXPECT_LE(norm(met.tangential), (1.0 + 1e-12) * a[14] * push);
    if (met.slides) {
      EXPECT_GE(norm(met.tangential), (1.0 - 1e-12) * a[14] * push);
    }
  }
  EXPECT_GT(slid, 30);
  EXPECT_GT(stuck, 30);
}

// Whatever comes near on the way is listed, and what goes along beside each other is not.
TEST(Pairs, AreFoundOnTheirWays) {
  constexpr int count = 60;
  constexpr double touching = 0.1, reach = 0.01;
  SelfContact s;
  s.nodes = 2 * count;
  std::vector<double> x, way, radius(2 * count, 0.5 * touching), reaches(2 * count, reach);
  for (int i = 0; i < count; ++i) {
    s.edges.push_back({2 * i, 2 * i + 1});
    const double at[3] = {uniform(-1.0, 1.0), uniform(-1.0, 1.0), uniform(-1.0, 1.0)};
    const double gone[3] = {uniform(-1.0, 1.0), uniform(-1.0, 1.0), uniform(-1.0, 1.0)};
    for (int k = 0; k < 2; ++k)
      for (int d = 0; d < 3; ++d) {
        x.push_back(at[d] + uniform(-0.1, 0.1));
        way.push_back(gone[d] + uniform(-0.05, 0.05));
      }
  }
  const Whereabouts at{x.data(), 3, radius.data(), reaches.data(), way.data()};
  const std::vector<PairKey> found = find_pairs(s, at);
  const auto is_found = [&](int i, int k) { return std::ranges::binary_search(found, PairKey{false, i, k}); };
  int near = 0;
  for (int i = 0; i < count; ++i)
    for (int k = i + 1; k < count; ++k) {
      double least = 1e300;
      for (int step = 0; step <= 400; ++step) {
        Coordinates there;
        const auto nodes = spots_of(s, {false, i, k});
        for (int d = 0; d < 12; ++d)
          there[d] = x[3 * nodes[d / 3] + d % 3] + step / 400.0 * way[3 * nodes[d / 3] + d % 3];
        least = std::min(least, distance_of(false, there.data(), {touching, 1.0}));
      }
      if (least <= touching + 2.0 * reach) {
        EXPECT_TRUE(is_found(i, k)) << i << " " << k;
        ++near;
      } else if (least > 1.2 * touching + 2.0 * reach) {
        EXPECT_FALSE(is_found(i, k)) << i << " " << k;
      }
    }
  EXPECT_GT(near, 10);
  for (double& d : way) d = 5.0;
  const Whereabouts standing{x.data(), 3, radius.data(), reaches.data()};
  const std::vector<PairKey> together = find_pairs(s, at), near_at_rest = find_pairs(s, standing);
  for (const PairKey& key : near_at_rest) EXPECT_TRUE(std::ranges::binary_search(together, key));
  EXPECT_LE(together.size(), near_at_rest.size() + 5);
}

bool meet(const Box& p, const Box& q) {
  for (int d = 0; d < 3; ++d)
    if (p.high[d] < q.low[d] || q.high[d] < p.low[d]) return false;
  return true;
}

// Boxes that move, far away and wide too, and some that are not finite.
TEST(Pairs, AreFoundByAGridWhileBoxesMove) {
  constexpr int count = 60;
  const auto any_box = [](double spread, double size) {
    Box box;
    for (int d = 0; d < 3; ++d) {
      box.low[d] = uniform(-spread, spread);
      box.high[d] = box.low[d] + uniform(0.0, size);
    }
    return box;
  };
  std::vector<Box> boxes;
  for (int i = 0; i < count; ++i) boxes.push_back(any_box(1.0, 0.4));
  boxes[5].low[1] = std::numeric_limits<double>::quiet_NaN();
  const auto is_finite = [](const Box& box) { return std::isfinite(box.high[1] - box.low[1]); };
  BoxGrid grid(boxes);
  std::size_t all = 0;
  for (int turn = 0; turn < 300; ++turn) {
    const int moved = turn % count;
    boxes[moved] = turn % 50 == 7    ? any_box(1e18, 1.0)
                   : turn % 50 == 17 ? any_box(1.0, 30.0)
                                     : any_box(1.2, turn % 3 == 0 ? 1.0 : 0.3);
    if (turn % 50 == 27) boxes[moved].low[1] = -HUGE_VAL, boxes[moved].high[1] = HUGE_VAL;
    grid.move(moved, boxes[moved]);
    const Box& of = boxes[turn * 7 % count];
    std::vector<int> expected;
    for (int i = 0; i < count && is_finite(of); ++i)
      if (is_finite(boxes[i]) && meet(boxes[i], of)) expected.push_back(i);
    EXPECT_EQ(grid.around(of), expected) << turn;
    all += expected.size();
  }
  EXPECT_GT(all, 300u);
}

TEST(Pairs, AreFoundByAGridAsByLookingAtAll) {
  for (const double size : {0.02, 0.2, 1.5}) {
    std::vector<Box> a, b;
    for (int i = 0; i < 150; ++i)
      for (auto* list : {&a, &b}) {
        Box box;
        for (int d = 0; d < 3; ++d) {
          box.low[d] = uniform(-1.0, 1.0);
          if (i == 8) box.low[d] -= 1e18 * d;
          box.high[d] = box.low[d] + uniform(0.0, i == 7 ? 3.0 : i % 40 == 9 ? 1e9 * size : size);
        }
        list->push_back(box);
      }
    for (const bool itself : {false, true}) {
      auto found = overlaps(a, b, itself);
      std::sort(found.begin(), found.end());
      std::vector<std::pair<int, int>> expected;
      for (int i = 0; i < 150; ++i)
        for (int k = itself ? i + 1 : 0; k < 150; ++k)
          if (meet(a[i], itself ? a[k] : b[k])) expected.emplace_back(i, k);
      EXPECT_EQ(found, expected);
    }
  }
}

}  // namespace
}  // namespace sheetbend::testing
