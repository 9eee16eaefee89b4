// Offsets of a cloud's points from a rope: against all links in turn, against a complex step and differences, and beyond its ends.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "adjoint/observe/cloud_of_ropes.h"
#include "core/scalar/complex.h"
#include "core/scalar/dual.h"

using namespace sheetbend;

namespace {

constexpr double noise = 1e-3;

// Two ropes: a helix of 12 links, and one link beside it.
struct Ropes {
  RopeLines lines;
  std::vector<double> x;

  Ropes() {
    std::vector<int> vertices;
    std::vector<std::array<int, 2>> links;
    for (int i = 0; i <= 12; ++i) {
      vertices.push_back(3 * i);
      x.insert(x.end(), {0.2 * std::cos(0.5 * i), 0.2 * std::sin(0.5 * i), 0.04 * i});
      if (i > 0) links.push_back({i - 1, i});
    }
    for (int i = 13; i <= 14; ++i) {
      vertices.push_back(3 * i);
      x.insert(x.end(), {0.5, 0.1 * (i - 13), 0.3});
    }
    links.push_back({13, 14});
    lines = make_rope_lines(vertices, links);
  }

  template <class T>
  void gather(const ClosestLink& closest, const double* point, T* own) const {
    for (int d = 0; d < 3; ++d) own[d] = T(point[d]);
    for (int k = 0; k < 2; ++k)
      for (int d = 0; d < 3; ++d) own[3 * (k + 1) + d] = T(x[3 * lines.links[closest.link][k] + d]);
  }

  std::array<double, 2> offsets(const double* point) const {
    const ClosestLink closest = closest_parts(lines, x.data(), point, 1)[0];
    double own[9];
    gather(closest, point, own);
    return distances(own, closest, noise);
  }
};

std::vector<double> around(int count) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> across(-0.3, 0.6), up(-0.1, 0.6);
  std::vector<double> points;
  for (int i = 0; i < count; ++i) points.insert(points.end(), {across(random), across(random), up(random)});
  return points;
}

TEST(CloudOfRopes, EndsAreThoseOfEachRope) {
  const Ropes ropes;
  int ends = 0;
  for (const auto& [first, second] : ropes.lines.ends) ends += first + second;
  EXPECT_EQ(ends, 4);
  EXPECT_TRUE(ropes.lines.ends[0][0] && ropes.lines.ends[11][1] && ropes.lines.ends[12][0] && ropes.lines.ends[12][1]);
  EXPECT_THROW(make_rope_lines({0, 3}, {{0, 2}}), std::invalid_argument);
}

TEST(CloudOfRopes, ClosestLinkIsThatOfAllLinks) {
  const Ropes ropes;
  const std::vector<double> points = around(300);
  const std::vector<ClosestLink> found = closest_parts(ropes.lines, ropes.x.data(), points.data(), 300);
  int inside = 0, corners = 0, over = 0;
  for (int i = 0; i < 300; ++i) {
    double least = std::numeric_limits<double>::infinity();  // from 200 places of each link
    for (const auto& [a, b] : ropes.lines.links)
      for (int k = 0; k <= 200; ++k) {
        double squared = 0.0;
        for (int d = 0; d < 3; ++d) {
          const double s = k / 200.0, at = (1 - s) * ropes.x[3 * a + d] + s * ropes.x[3 * b + d];
          squared += (at - points[3 * i + d]) * (at - points[3 * i + d]);
        }
        least = std::min(least, squared);
      }
    double own[9];
    ropes.gather(found[i], &points[3 * i], own);
    const double distance = norm(Vec3<double>(own) - closest_place(own, found[i]));
    EXPECT_LE(distance, std::sqrt(least) + 1e-15);
    EXPECT_NEAR(distance, std::sqrt(least), 1e-4);
    const auto [first, second] = distances(own, found[i], noise);
    const double off = std::hypot(first, second);
    EXPECT_LE(off, distance + 1e-14);
    if (found[i].at < 0) {
      EXPECT_NEAR(off, distance, 1e-14);
    }
    ++(found[i].at < 0 ? inside : found[i].over ? over : corners);
  }
  EXPECT_GT(inside, 100);
  EXPECT_GT(corners, 10);
  EXPECT_GT(over, 10);
}

TEST(CloudOfRopes, PointsThatAreNotSeenHaveNoLink) {
  const Ropes ropes;
  const double none = std::numeric_limits<double>::quiet_NaN();
  const double points[] = {none, none, none, 0.2, 0.0, 0.0};
  const std::vector<ClosestLink> found = closest_parts(ropes.lines, ropes.x.data(), points, 2);
  EXPECT_TRUE(found[0].is_none());
  EXPECT_FALSE(found[1].is_none());
}

TEST(CloudOfRopes, DerivativeIsThatOfAComplexStep) {
  const Ropes ropes;
  const std::vector<double> points = around(200);
  const std::vector<ClosestLink> found = closest_parts(ropes.lines, ropes.x.data(), points.data(), 200);
  for (int i = 0; i < 200; ++i)
    for (int k = 3; k < 9; ++k) {
      Dual<double, 4> dual[9];
      Complex complex[9];
      ropes.gather(found[i], &points[3 * i], dual);
      ropes.gather(found[i], &points[3 * i], complex);
      dual[k].d[0] = 1.0;
      complex[k].im = 1e-30;
      const auto by_dual = distances(dual, found[i], noise);
      const auto by_complex = distances(complex, found[i], noise);
      for (int row = 0; row < 2; ++row) EXPECT_NEAR(by_dual[row].d[0], by_complex[row].im / 1e-30, 1e-12);
    }
}

// It is also that of the offsets whose closest link is found anew, where the link stays the closest one.
TEST(CloudOfRopes, DerivativeIsThatOfTheClosestLinkFoundAnew) {
  Ropes ropes;
  const std::vector<double> points = around(200);
  const std::vector<ClosestLink> found = closest_parts(ropes.lines, ropes.x.data(), points.data(), 200);
  const double h = 1e-7;
  int compared = 0;
  for (int i = 0; i < 200; ++i)
    for (int k = 3; k < 9; ++k) {
      Dual<double, 4> dual[9];
      ropes.gather(found[i], &points[3 * i], dual);
      dual[k].d[0] = 1.0;
      const auto exact = distances(dual, found[i], noise);
      double& moved = ropes.x[3 * ropes.lines.links[found[i].link][k / 3 - 1] + k % 3];
      const double at = moved;
      moved = at + h;
      const auto after = ropes.offsets(&points[3 * i]);
      moved = at - h;
      const auto before = ropes.offsets(&points[3 * i]);
      moved = at;
      if (std::hypot(after[0] - before[0], after[1] - before[1]) > 20 * h) continue;  // another link
      for (int row = 0; row < 2; ++row)
        EXPECT_NEAR(exact[row].d[0], (after[row] - before[row]) / (2 * h), 1e-5 * (1.0 + std::abs(exact[row].d[0])));
      ++compared;
    }
  EXPECT_GT(compared, 1150);
}

// Up to three sigmas beyond an end only the distance from the line counts; from there on what is beyond adds to it.
TEST(CloudOfRopes, NoiseBeyondAnEndDoesNotPull) {
  Ropes ropes;
  ropes.lines = make_rope_lines({0, 3}, {{0, 1}});
  ropes.x = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0};
  const auto size = [&](double x, double y, double z) {
    const double point[3] = {x, y, z};
    const auto [first, second] = ropes.offsets(point);
    return std::hypot(first, second);
  };
  EXPECT_NEAR(size(0.4, 3 * noise, 4 * noise), 5 * noise, 1e-15);
  EXPECT_NEAR(size(1.0 + 2.9 * noise, 3 * noise, 4 * noise), 5 * noise, 1e-15);
  EXPECT_NEAR(size(-2.9 * noise, 3 * noise, 4 * noise), 5 * noise, 1e-15);
  EXPECT_NEAR(size(1.0 + 15 * noise, 3 * noise, 4 * noise), 13 * noise, 1e-15);
  EXPECT_NEAR(size(-15 * noise, 3 * noise, 4 * noise), 13 * noise, 1e-15);
  EXPECT_NEAR(size(1.0 + 7 * noise, 0.0, 0.0), 4 * noise, 1e-15);
}

// The directions of the offsets are those of a frame that is turned onto the link; one link has no such turn.
TEST(CloudOfRopes, EveryDirectionOfALinkHasOffsets) {
  Ropes ropes;
  ropes.lines = make_rope_lines({0, 3}, {{0, 1}});
  const double across[3] = {0.8, -0.6, 0.0};
  for (const double bend : {0.0, 1e-12, 1e-6, 1e-4, 1e-2, 1.0, 100.0}) {
    const Vec3<double> along(-0.36 + bend * across[0], -0.48 + bend * across[1], -0.8);
    ropes.x = {0.0, 0.0, 0.0, along.x, along.y, along.z};
    const Vec3<double> off = cross(along, Vec3<double>(0.1, 0.2, -0.3)), point = 0.3 * along + off;
    const double at[3] = {point.x, point.y, point.z};
    const auto [first, second] = ropes.offsets(at);
    EXPECT_NEAR(std::hypot(first, second), norm(off), 1e-6 * norm(point));  // digits are lost near that one
  }
}

}  // namespace
