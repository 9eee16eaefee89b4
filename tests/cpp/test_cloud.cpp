// Distances of a cloud's points from a cloth: against all triangles in turn, against a complex step, and over borders and folds.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "adjoint/observe/cloud.h"
#include "core/scalar/complex.h"
#include "core/scalar/dual.h"

using namespace sheetbend;

namespace {

constexpr double sigma = 1e-3;

// A sheet of n by n cells of 0.1 m, bent and creased.
struct Sheet {
  ClothSurface surface;
  std::vector<double> x;

  explicit Sheet(int n) {
    std::vector<int> vertices;
    std::vector<std::array<int, 3>> corners;
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j) {
        vertices.push_back(3 * static_cast<int>(vertices.size()));
        const double u = 0.1 * i, v = 0.1 * j;
        x.insert(x.end(), {u, v, 0.3 * u * u - 0.2 * u * v + 0.05 * std::sin(20.0 * v)});
      }
    const auto at = [&](int i, int j) { return i * (n + 1) + j; };
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        corners.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
        corners.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
      }
    surface = make_cloth_surface(vertices, corners);
  }

  template <class T>
  void gather(const ClosestPart& part, const double* point, T* own) const {
    for (int d = 0; d < 3; ++d) own[d] = T(point[d]);
    for (int k = 0; k < 3; ++k)
      for (int d = 0; d < 3; ++d) own[3 * (k + 1) + d] = T(x[3 * surface.corners[part.triangle][k] + d]);
  }

  double distance(const double* point) const {
    const ClosestPart part = closest_parts(surface, x.data(), point, 1)[0];
    double own[12];
    gather(part, point, own);
    return surface_distance(own, part, sigma);
  }
};

std::vector<double> scattered(int count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> across(-0.15, 0.65), up(-0.2, 0.3);
  std::vector<double> points;
  for (int i = 0; i < count; ++i) points.insert(points.end(), {across(random), across(random), up(random)});
  return points;
}

TEST(Cloud, ClosestPartIsThatOfAllTriangles) {
  const Sheet sheet(5);
  const std::vector<double> points = scattered(400);
  const std::vector<ClosestPart> parts = closest_parts(sheet.surface, sheet.x.data(), points.data(), 400);
  int borders = 0, edges = 0, inside = 0;
  for (int i = 0; i < 400; ++i) {
    double least = std::numeric_limits<double>::infinity(), own[12];
    for (int t = 0; t < static_cast<int>(sheet.surface.corners.size()); ++t) {
      sheet.gather({t, {}, false}, &points[3 * i], own);
      least = std::min(least, nearest_on_triangle(own, part_of_triangle(own)).squared);
    }
    sheet.gather(parts[i], &points[3 * i], own);
    EXPECT_NEAR(nearest_on_triangle(own, parts[i].part).squared, least, 1e-15);
    ++(parts[i].part.first < 0 ? inside : parts[i].at_border ? borders : edges);
  }
  EXPECT_GT(borders, 20);
  EXPECT_GT(edges, 20);
  EXPECT_GT(inside, 20);
}

TEST(Cloud, PointsThatAreNotSeenHaveNoPart) {
  const Sheet sheet(2);
  const double none = std::numeric_limits<double>::quiet_NaN();
  const double points[] = {none, none, none, 0.05, 0.05, 0.1};
  const std::vector<ClosestPart> parts = closest_parts(sheet.surface, sheet.x.data(), points, 2);
  EXPECT_EQ(parts[0].triangle, -1);
  EXPECT_GE(parts[1].triangle, 0);
}

// The derivative with respect to the corners, of a part that is held, is that of the formula.
TEST(Cloud, DerivativeIsThatOfAComplexStep) {
  const Sheet sheet(5);
  const std::vector<double> points = scattered(200);
  const std::vector<ClosestPart> parts = closest_parts(sheet.surface, sheet.x.data(), points.data(), 200);
  for (int i = 0; i < 200; ++i)
    for (int k = 3; k < 12; ++k) {
      Dual<double, 4> dual[12];
      Complex complex[12];
      sheet.gather(parts[i], &points[3 * i], dual);
      sheet.gather(parts[i], &points[3 * i], complex);
      dual[k].d[0] = 1.0;
      complex[k].im = 1e-30;
      const double exact = surface_distance(complex, parts[i], sigma).im / 1e-30;
      EXPECT_NEAR(surface_distance(dual, parts[i], sigma).d[0], exact, 1e-12);
    }
}

// It is also that of the distance itself, whose closest part is found anew: the closest point moves within the surface.
TEST(Cloud, DerivativeIsThatOfTheClosestPointFoundAnew) {
  Sheet sheet(5);
  const std::vector<double> points = scattered(200);
  const std::vector<ClosestPart> parts = closest_parts(sheet.surface, sheet.x.data(), points.data(), 200);
  const double h = 1e-7;
  int compared = 0;
  for (int i = 0; i < 200; ++i)
    for (int k = 3; k < 12; ++k) {
      Dual<double, 4> dual[12];
      sheet.gather(parts[i], &points[3 * i], dual);
      dual[k].d[0] = 1.0;
      double& moved = sheet.x[3 * sheet.surface.corners[parts[i].triangle][k / 3 - 1] + k % 3];
      const double at = moved;
      moved = at + h;
      const double after = sheet.distance(&points[3 * i]);
      moved = at - h;
      const double before = sheet.distance(&points[3 * i]);
      moved = at;
      if (std::abs(after - before) > 0.1 * h * 20) continue;  // the side changed: at a border alone
      EXPECT_NEAR(surface_distance(dual, parts[i], sigma).d[0], (after - before) / (2 * h), 2e-5);
      ++compared;
    }
  EXPECT_GT(compared, 1700);
}

// Up to three sigmas over a border only the distance from the plane counts; from there on what is beyond adds to it.
TEST(Cloud, NoiseOverABorderDoesNotPull) {
  const std::vector<double> flat = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0};
  Sheet sheet(1);
  sheet.surface = make_cloth_surface({0, 3, 6, 9}, {{0, 1, 2}, {0, 2, 3}});
  sheet.x = flat;
  const auto at = [&](double x, double y, double z) {
    const double point[3] = {x, y, z};
    return sheet.distance(point);
  };
  EXPECT_NEAR(at(1.0 + 2.9 * sigma, 0.3, 2 * sigma), 2 * sigma, 1e-15);
  EXPECT_NEAR(at(1.0 + 2.9 * sigma, 0.3, -2 * sigma), -2 * sigma, 1e-15);
  EXPECT_NEAR(at(1.0 + 7 * sigma, 0.3, 3 * sigma), 5 * sigma, 1e-15);
  EXPECT_NEAR(at(1.0 + 3 * sigma, 0.3, 2 * sigma), at(1.0 + 3.0001 * sigma, 0.3, 2 * sigma), 1e-8);
  EXPECT_NEAR(at(1.0 + 2 * sigma, 1.0 + 2 * sigma, sigma), sigma, 1e-15);  // a corner
  EXPECT_NEAR(at(0.5, 0.5, sigma), sigma, 1e-15);                          // the diagonal, which is no border
}

// Along a line over a crease the distance has no step: not from a face to the edge, nor through the surface.
TEST(Cloud, DistanceIsContinuousOverACrease) {
  Sheet sheet(1);
  sheet.surface = make_cloth_surface({0, 3, 6, 9}, {{0, 1, 2}, {0, 2, 3}});
  sheet.x = {0.0, 0.0, 0.0, 1.0, 0.0, -0.4, 1.0, 1.0, 0.0, 0.0, 1.0, -0.4};  // a roof over the diagonal
  double last = 0.0;
  for (int i = 0; i <= 2000; ++i) {
    const double s = i / 2000.0, point[3] = {0.4 + 0.3 * s, 0.6 - 0.3 * s, 0.3 - 0.5 * s};
    const double now = sheet.distance(point);
    if (i > 0) {
      EXPECT_LT(std::abs(now - last), 6e-4);
    }
    last = now;
  }
  EXPECT_LT(last, 0.0);
}

}  // namespace
