// Our atan2 against the library's in extended precision, and its values where IEEE 754 names them.
#include "core/scalar/pack.h"
#include "tests/cpp/support/compare.h"

namespace sheetbend::testing {
namespace {

// Errors of `angle_of` and of nothing else, in units in the last place of the true value.
double error_in_ulp(double y, double x) {
  const long double truth = atan2l(y, x);
  const double rounded = std::abs(static_cast<double>(truth)), ulp = std::nextafter(rounded, 4.0) - rounded;
  return static_cast<double>(std::abs(angle_of(y, x) - truth) / ulp);
}

class Atan2 : public ::testing::Test {
 protected:
  Random random{50};
  double worst = 0.0;
  void look_at(double y, double x) {
    for (const double sy : {y, -y})
      for (const double sx : {x, -x}) {
        worst = std::max({worst, error_in_ulp(sy, sx), error_in_ulp(sx, sy)});
      }
  }
};

TEST_F(Atan2, IsWithinTwoUnitsInTheLastPlace) {
  if (std::numeric_limits<long double>::digits < 64) GTEST_SKIP() << "long double is no wider than double here";
  for (int i = 0; i < 200'000; ++i) {
    look_at(random(0.0, 1.0), random(0.0, 1.0));
    look_at(random(0.49, 0.51), 1.0);  // where one reduction gives way to the other
    look_at(std::ldexp(random(0.5, 1.0), static_cast<int>(random(-60.0, 0.0))), 1.0);
    look_at(std::ldexp(random(0.5, 1.0), static_cast<int>(random(-500.0, 500.0))),
            std::ldexp(random(0.5, 1.0), static_cast<int>(random(-500.0, 500.0))));
  }
  EXPECT_LE(worst, 2.0);
  EXPECT_GE(worst, 0.5);  // the yardstick sees rounding
  record_error("ulp", worst);
}

TEST_F(Atan2, HasTheSignsAndQuadrantsOfTheLibrary) {
  const double tiny = std::numeric_limits<double>::denorm_min(), large = 0x1p1022;
  const double values[] = {0.0, tiny, 0x1p-1022, 0x1p-600, 0.1, 1.0, 3.0, 0x1p600, large};
  const auto look = [](double y, double x) {
    const double found = angle_of(y, x), expected = std::atan2(y, x);
    EXPECT_NEAR(found, expected, 1e-15) << y << ", " << x;
    EXPECT_EQ(std::signbit(found), std::signbit(expected)) << y << ", " << x;
    if (y == 0.0 || x == 0.0) {
      EXPECT_EQ(found, expected) << y << ", " << x;
    }
  };
  for (const double y : values)
    for (const double x : values) look(y, x), look(-y, x), look(y, -x), look(-y, -x);
}

TEST_F(Atan2, OfWhatIsNotANumberIsNone) {
  for (const double other : {0.0, -0.0, 1.0, -2.0, std::nan("")}) {
    EXPECT_TRUE(std::isnan(angle_of(std::nan(""), other))) << other;
    EXPECT_TRUE(std::isnan(angle_of(other, std::nan("")))) << other;
  }
}

TEST_F(Atan2, HasTheSameBitsInEveryLane) {
  for (int i = 0; i < 10'000; ++i) {
    Pack y, x;
    for (int lane = 0; lane < Pack::lanes; ++lane) y.set(lane, random(-1.0, 1.0)), x.set(lane, random(-1.0, 1.0));
    if (i == 0) y.set(1, 0.0), y.set(2, -0.0), x.set(2, -1.0), x.set(3, -0.0), x.set(4, 0.0), y.set(4, 0.0);
    const Pack angle = atan2(y, x);
    for (int lane = 0; lane < Pack::lanes; ++lane)
      ASSERT_TRUE(same_bits<double>({angle[lane]}, {angle_of(y[lane], x[lane])})) << y[lane] << ", " << x[lane];
  }
}

}  // namespace
}  // namespace sheetbend::testing
