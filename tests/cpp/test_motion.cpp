// Interpolation between knots: x(t) = sum_i weight_i knot_i.
#include "core/scene/motion.h"

#include "tests/cpp/support/compare.h"

namespace sheetbend::testing {
namespace {

const std::vector<double> uneven{0.0, 0.1, 0.15, 0.5, 0.51, 1.0};

double value(const Knots& knots, const std::vector<double>& values, double t) {
  const KnotWeights w = knots.at(t);
  double sum = 0.0;
  for (int i = 0; i < w.count; ++i) sum += w.weight[i] * values.at(w.first + i);
  return sum;
}

std::vector<double> sampled(const std::vector<double>& times, double (*f)(double)) {
  std::vector<double> v;
  for (const double t : times) v.push_back(f(t));
  return v;
}

// The slope of a cubic at t, exact from four of its values at distance h.
double slope(const Knots& knots, const std::vector<double>& values, double t, double h) {
  const auto f = [&](int i) { return value(knots, values, t + i * h); };
  return (-11.0 * value(knots, values, t) + 18.0 * f(1) - 9.0 * f(2) + 2.0 * f(3)) / (6.0 * h);
}

struct Motion : ::testing::TestWithParam<Interpolation> {};
INSTANTIATE_TEST_SUITE_P(, Motion, ::testing::Values(Interpolation::linear, Interpolation::cubic),
                         [](const auto& param) { return param.param == Interpolation::linear ? "Linear" : "Cubic"; });

TEST_P(Motion, WeightsSumToOneAndStayInside) {
  const Knots knots{uneven, GetParam()};
  for (int i = -20; i <= 220; ++i) {
    const KnotWeights w = knots.at(i / 200.0);
    EXPECT_GE(w.first, 0);
    EXPECT_LE(w.first + w.count, static_cast<int>(uneven.size()));
    double sum = 0.0;
    for (int k = 0; k < w.count; ++k) sum += w.weight[k];
    EXPECT_NEAR(sum, 1.0, 1e-14) << "t = " << i / 200.0;
  }
}

TEST_P(Motion, PassesThroughItsKnotsAndHoldsItsEnds) {
  const Knots knots{uneven, GetParam()};
  const std::vector<double> values{3, -1, 4, 1, -5, 9};
  for (std::size_t i = 0; i < uneven.size(); ++i) EXPECT_NEAR(value(knots, values, uneven[i]), values[i], 1e-14);
  EXPECT_EQ(value(knots, values, -1.0), 3.0);
  EXPECT_EQ(value(knots, values, 2.0), 9.0);
}

TEST_P(Motion, OneAndTwoKnotsWork) {
  EXPECT_EQ(value({{0.3}, GetParam()}, {7.0}, 0.3), 7.0);
  EXPECT_EQ(value({{0.3}, GetParam()}, {7.0}, 9.0), 7.0);
  EXPECT_NEAR(value({{0.0, 2.0}, GetParam()}, {1.0, 5.0}, 0.5), 2.0, 1e-15);
}

TEST(LinearMotion, IsExactForLines) {
  const auto line = [](double t) { return 3.0 - 2.0 * t; };
  for (int i = 0; i <= 100; ++i)
    EXPECT_NEAR(value({uneven, Interpolation::linear}, sampled(uneven, line), i / 100.0), line(i / 100.0), 1e-14);
}

// Exact where three knots give both slopes; in the end pieces the outer slope is one-sided.
TEST(CubicMotion, IsExactForQuadraticsOnUnevenKnots) {
  const auto parabola = [](double t) { return 1.0 - 3.0 * t + 5.0 * t * t; };
  const Knots knots{uneven, Interpolation::cubic};
  const auto values = sampled(uneven, parabola);
  for (double t = uneven[1]; t <= uneven[4]; t += 1.0 / 512)
    EXPECT_NEAR(value(knots, values, t), parabola(t), 1e-14) << t;
  const auto line = [](double t) { return 3.0 - 2.0 * t; };
  for (int i = 0; i <= 100; ++i) EXPECT_NEAR(value(knots, sampled(uneven, line), i / 100.0), line(i / 100.0), 1e-14);
}

TEST(CubicMotion, HasContinuousSlopes) {
  const Knots knots{uneven, Interpolation::cubic};
  const std::vector<double> values{3, -1, 4, 1, -5, 9};
  for (std::size_t i = 1; i + 1 < uneven.size(); ++i) {
    const double h = 1e-3, left = slope(knots, values, uneven[i], -h), right = slope(knots, values, uneven[i], h);
    EXPECT_NEAR(left / right, 1.0, 1e-9) << "knot " << i;
  }
}

TEST(LinearMotion, KicksAtItsKnots) {
  const Knots knots{uneven, Interpolation::linear};
  const std::vector<double> values{3, -1, 4, 1, -5, 9};
  EXPECT_NEAR(slope(knots, values, uneven[1], -1e-3), -40.0, 1e-9);
  EXPECT_NEAR(slope(knots, values, uneven[1], 1e-3), 100.0, 1e-9);
}

}  // namespace
}  // namespace sheetbend::testing
