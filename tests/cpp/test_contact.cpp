// Shapes, the law of contact and poses, one by one against complex steps.
#include <Eigen/LU>
#include <tuple>

#include "adjoint/contact/touch_vjp.h"
#include "core/contact/balanced.h"
#include "tests/cpp/support/compare.h"
#include "tests/cpp/support/distance_grids.h"

namespace sheetbend::testing {
namespace {

constexpr double sizes[shape_count][most_sizes] = {{}, {0.8}, {0.5, 0.7}, {0.9, 0.7, 0.5, 0.15}, {0.8, 0.5, 0.15}};
// Near a face, an edge and a corner of the box, and likewise around the others; all below their surface or above.
constexpr double points[][3] = {
    {0.3, -0.2, 0.45}, {-0.3, 0.3, 0.8}, {0.85, 0.66, 0.1}, {-0.84, 0.6, -0.42}, {0.2, 0.3, -1.0}};

const auto ball = ball_on_grid(0.8, 0.21);
AnyShape any(int shape) { return {shape, shape == shape_of("distance_field") ? ball.get() : nullptr}; }

template <class T>
Vec3<T> lift(const double* v) {
  return {T(v[0]), T(v[1]), T(v[2])};
}

TEST(Shapes, HaveTheGradientOfTheirDistanceAsNormal) {
  for (int shape = 0; shape < shape_count; ++shape)
    for (const auto& point : points) {
      double distance, n[3];
      distance_from(any(shape), point, sizes[shape], distance, n);
      EXPECT_NEAR(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1.0, any(shape).grid ? 0.2 : 1e-14);
      Complex size[most_sizes];
      for (int k = 0; k < most_sizes; ++k) size[k] = sizes[shape][k];
      for (int d = 0; d < 3; ++d) {
        Complex z[3] = {point[0], point[1], point[2]}, there, normal[3];
        z[d].im = complex_step;
        distance_from(any(shape), z, size, there, normal);
        EXPECT_NEAR(there.im / complex_step, n[d], 1e-14) << shape;
        EXPECT_EQ(there.re, distance);
      }
    }
}

TEST(Shapes, AreAsFarAsTheyShould) {
  const auto far = [](const char* name, std::vector<double> size, const std::vector<double>& z) {
    double distance, n[3];
    distance_from(shape_of(name), z.data(), size.data(), distance, n);
    return distance;
  };
  EXPECT_DOUBLE_EQ(far("plane", {}, {3.0, 4.0, -0.5}), -0.5);
  EXPECT_DOUBLE_EQ(far("sphere", {2.0}, {3.0, 0.0, 4.0}), 3.0);
  EXPECT_DOUBLE_EQ(far("capsule", {0.5, 1.0}, {0.0, 3.0, 0.7}), 2.5);
  EXPECT_DOUBLE_EQ(far("capsule", {0.5, 1.0}, {3.0, 0.0, -5.0}), 4.5);
  EXPECT_DOUBLE_EQ(far("rounded_box", {1.0, 2.0, 3.0, 0.1}, {4.0, 0.0, 0.0}), 3.0);
  EXPECT_DOUBLE_EQ(far("rounded_box", {1.0, 2.0, 3.0, 0.1}, {0.0, 1.5, 0.0}), -0.5);
  EXPECT_NEAR(far("rounded_box", {1.0, 2.0, 3.0, 0.1}, {3.9, 5.9, 0.0}), 4.9, 1e-14);
  EXPECT_DOUBLE_EQ(far("rounded_cylinder", {2.0, 3.0, 0.1}, {2.4, 3.2, 0.0}), 2.0);
  EXPECT_DOUBLE_EQ(far("rounded_cylinder", {2.0, 3.0, 0.1}, {1.2, -0.9, 3.5}), 0.5);
  EXPECT_DOUBLE_EQ(far("rounded_cylinder", {2.0, 3.0, 0.1}, {0.0, 1.2, 0.5}), -0.8);
  EXPECT_DOUBLE_EQ(far("rounded_cylinder", {2.0, 3.0, 0.1}, {0.3, 0.4, -2.8}), -0.2);
  EXPECT_NEAR(far("rounded_cylinder", {2.0, 3.0, 0.1}, {0.0, 4.9, 6.9}), 4.9, 1e-14);
  EXPECT_THROW(shape_of("teapot"), std::invalid_argument);
}

TEST(Shapes, HaveANormalWhereThereIsNoDirection) {
  const double center[3] = {};
  for (int shape = 0; shape < shape_count; ++shape) {
    double distance, n[3];
    distance_from(any(shape), center, sizes[shape], distance, n);
    EXPECT_TRUE(std::isfinite(distance));
    EXPECT_DOUBLE_EQ(norm(unit_normal(any(shape), Vec3<double>(n))), 1.0);
  }
}

// A point below the surface that was somewhere else before, held by a force: slides or sticks as friction says.
struct Sample {
  int shape;
  Vec3<double> z;
  ContactNumbers<double> numbers;
};
std::vector<Sample> samples() {
  std::vector<Sample> all;
  for (int shape = 0; shape < shape_count; ++shape)
    for (const auto& point : points)
      for (const double friction : {0.0, 0.1, 50.0}) {
        Sample s{shape, Vec3<double>(point), {}};
        std::copy_n(sizes[shape], most_sizes, s.numbers.size);
        double distance, n[3];
        distance_from(any(shape), point, sizes[shape], distance, n);
        s.numbers.from = s.z - Vec3<double>(2e-3, 3e-3, -1e-3);
        s.numbers.carried = {0.7, -0.4, 0.5};
        s.numbers.friction = friction;
        s.numbers.radius = distance + 0.01;
        s.numbers.kappa = 120.0;
        all.push_back(s);
      }
  return all;
}

TEST(Law, PushesNeverPullsAndStaysInItsCone) {
  int sliding = 0, sticking = 0;
  for (Sample s : samples()) {
    double distance, at[3], n[3];
    s.z.store(at);
    distance_from(any(s.shape), at, s.numbers.size, distance, n);
    const Touch<double> t = touch(any(s.shape), s.z, s.numbers);
    ASSERT_TRUE(t.pushes);
    EXPECT_NEAR(t.normal, 120.0 * 0.01, 1e-12);
    const double steep = norm(Vec3<double>(n));
    EXPECT_NEAR(dot(t.force, Vec3<double>(n)), steep * steep * t.normal, 1e-12);
    EXPECT_NEAR(dot(t.tangential, Vec3<double>(n)), 0.0, 1e-12);
    EXPECT_LE(norm(t.tangential), s.numbers.friction * steep * t.normal * (1.0 + 1e-14));
    if (t.slides && s.numbers.friction > 0.0) {
      EXPECT_NEAR(norm(t.tangential), s.numbers.friction * steep * t.normal, 1e-13);
      ++sliding;
    }
    sticking += !t.slides;
    s.numbers.radius = distance - 1e-9;
    const Touch<double> away = touch(any(s.shape), s.z, s.numbers);
    EXPECT_FALSE(away.pushes);
    EXPECT_EQ(norm(away.force), 0.0);
    EXPECT_EQ(norm(away.tangential), 0.0);
  }
  EXPECT_GT(sliding, 10);
  EXPECT_GT(sticking, 10);
}

// All that the law reads, in one vector.
template <class T>
Touch<T> touch_at(int shape, const std::vector<T>& a) {
  ContactNumbers<T> c{Vec3<T>(&a[3]), Vec3<T>(&a[6]), a[9], a[10], a[11], {}};
  std::copy_n(&a[12], most_sizes, c.size);
  return touch(any(shape), Vec3<T>(a.data()), c);
}
std::vector<double> flat(const Sample& s) {
  std::vector<double> a(12 + most_sizes);
  s.z.store(&a[0]), s.numbers.from.store(&a[3]), s.numbers.carried.store(&a[6]);
  a[9] = s.numbers.friction, a[10] = s.numbers.radius, a[11] = s.numbers.kappa;
  std::copy_n(s.numbers.size, most_sizes, &a[12]);
  return a;
}

TEST(Law, HasTheDerivativesOfComplexSteps) {
  const Vec3<double> force_bar(0.3, -1.1, 0.7), tangential_bar(-0.2, 0.5, 0.9);
  for (const Sample& s : samples()) {
    SCOPED_TRACE(s.shape);
    ContactNumbers<double> bar{};
    const Vec3<double> z_bar = touch_vjp(any(s.shape), s.z, s.numbers, force_bar, tangential_bar, bar);
    const std::vector<double> found = flat({s.shape, z_bar, bar});
    const auto expected = complex_step_gradient(
        [&](const std::vector<Complex>& a) {
          const Touch<Complex> t = touch_at(s.shape, a);
          return dot(lift<Complex>(&force_bar.x), t.force) + dot(lift<Complex>(&tangential_bar.x), t.tangential);
        },
        flat(s));
    EXPECT_LE(relative_error(found, expected), 1e-13);
  }
}

TEST(Law, HasTheMatrixOfComplexSteps) {
  for (const Sample& s : samples()) {
    SCOPED_TRACE(s.shape);
    double A[9], without[9];
    touch_matrix(any(s.shape), s.z, s.numbers, true, A);
    touch_matrix(any(s.shape), s.z, s.numbers, false, without);
    std::vector<double> expected(9);
    for (int b = 0; b < 3; ++b) {
      std::vector<Complex> a;
      for (const double v : flat(s)) a.push_back(v);
      a[b].im = complex_step;
      const Vec3<Complex> force = touch_at(s.shape, a).force;
      expected[b] = -force.x.im / complex_step;
      expected[3 + b] = -force.y.im / complex_step;
      expected[6 + b] = -force.z.im / complex_step;
    }
    EXPECT_LE(relative_error(std::vector<double>(A, A + 9), expected), 1e-13);
    const double apart = relative_error(std::vector<double>(without, without + 9), expected);
    if (s.shape == shape_of("plane")) {
      EXPECT_LE(apart, 1e-13);
    } else if (s.shape == shape_of("sphere")) {
      EXPECT_GT(apart, 1e-4);
    }
  }
}

// What contacts between sweeps solve, z = y + w F(z).
TEST(Balance, IsWhereAPointAndItsForceAgree) {
  for (const Sample& s : samples()) {
    const double w = rigidity / s.numbers.kappa;
    const Balanced b = balanced(any(s.shape), s.z, w, s.numbers);
    ASSERT_TRUE(b.found && b.pushes) << s.shape;
    EXPECT_LT(largest_of(unbalance(any(s.shape), b.z, s.z, w, s.numbers)), 1e-11) << s.shape;
  }
}

TEST(Poses, TurnAboutTheirAxisByItsLength) {
  double turn[9];
  turn_by(Vec3<double>(0.0, 0.0, M_PI / 2.0), turn);
  const Pose<double> quarter{{1.0, 2.0, 3.0},
                             {turn[0], turn[1], turn[2], turn[3], turn[4], turn[5], turn[6], turn[7], turn[8]}};
  const Vec3<double> v = quarter.turned({1.0, 0.0, 0.5});
  EXPECT_NEAR(v.x, 0.0, 1e-15);
  EXPECT_NEAR(v.y, 1.0, 1e-15);
  EXPECT_NEAR(v.z, 0.5, 1e-15);
  EXPECT_NEAR(quarter.in_frame({1.0, 3.0, 3.0}).x, 1.0, 1e-15);
  // The series near zero goes on where Rodrigues' formula ends.
  for (const double angle : {0.0, 1e-9, 0.0316, 0.0317, 2.0, 9.0}) {
    const Vec3<double> r = angle * Vec3<double>(2.0 / 7.0, -3.0 / 7.0, 6.0 / 7.0);
    turn_by(r, turn);
    const Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(turn);
    EXPECT_LE((R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 4e-15) << angle;
    EXPECT_NEAR(R.trace(), 1.0 + 2.0 * std::cos(angle), 4e-15);
    const std::vector<double> bar{0.3, -0.8, 0.5, 0.9, 0.1, -0.4, 0.2, 0.6, -0.7};
    const Vec3<double> back = turn_by_vjp(r, bar.data());
    const auto expected = complex_step_gradient(
        [&](const std::vector<Complex>& at) {
          Complex turned[9], sum;
          turn_by(Vec3<Complex>(at.data()), turned);
          for (int k = 0; k < 9; ++k) sum += Complex(bar[k]) * turned[k];
          return sum;
        },
        {r.x, r.y, r.z});
    EXPECT_LE(relative_error(std::vector<double>{back.x, back.y, back.z}, expected), 1e-12) << angle;
  }
}

}  // namespace
}  // namespace sheetbend::testing
