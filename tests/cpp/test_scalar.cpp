// The scalars that kernels run on: each gives the value that double gives, and the derivatives that the
// complex step gives.
#include "core/scalar/dual.h"
#include "core/scalar/pack.h"
#include "core/scalar/vec3.h"
#include "tests/cpp/support/compare.h"

namespace sheetbend::testing {
namespace {

static_assert(Scalar<double> && Scalar<Complex> && Scalar<Pack> && Scalar<Dual<double, 3>> && Scalar<Dual<Pack, 2>> &&
              Scalar<Dual<Dual<double, 1>, 1>> && Scalar<Dual<Complex, 1>>);

// Everything that a scalar offers, in one smooth function of two variables.
template <class T>
T kernel_mixture(const T& a, const T& b) {
  T c = sqrt(a) / (T(1.5) + b) - (a + b) * atan2(a, -b);
  c += -a;
  c -= b * b;
  c *= a + T(2.0);
  return select(a > b, c, a) + select(a < b, a, T(0.25) * b) + nearest(T(3.3) * a);
}

// With the functions that only scalars outside of kernels offer.
template <class T>
T mixture(const T& a, const T& b) {
  return kernel_mixture(a, b) + sin(b) * cos(a) - log(a + b);
}

constexpr double a0 = 1.7, b0 = 0.6;
const auto oracle = [](double va, double vb) {
  return complex_step_along([](const std::vector<Complex>& z) { return std::vector{mixture(z[0], z[1])}; }, {a0, b0},
                            {va, vb})[0];
};

TEST(Complex, HasTheValueOfDouble) { EXPECT_NEAR(mixture(Complex(a0), Complex(b0)).re, mixture(a0, b0), 1e-15); }

// Against a central difference once, so that the oracle itself does not stand on air.
TEST(Complex, StepMatchesCentralDifference) {
  const double h = 1e-6, da = (mixture(a0 + h, b0) - mixture(a0 - h, b0)) / (2 * h),
               db = (mixture(a0, b0 + h) - mixture(a0, b0 - h)) / (2 * h);
  EXPECT_NEAR(oracle(1, 0), da, 1e-8);
  EXPECT_NEAR(oracle(0, 1), db, 1e-8);
}

TEST(Dual, DirectionsMatchComplexStep) {
  Dual<double, 2> a = a0, b = b0;
  a.d[0] = 1.0, b.d[1] = 1.0;
  const Dual<double, 2> r = mixture(a, b);
  EXPECT_EQ(r.v, mixture(a0, b0));
  EXPECT_NEAR(r.d[0], oracle(1, 0), 1e-14);
  EXPECT_NEAR(r.d[1], oracle(0, 1), 1e-14);
}

TEST(Dual, NestsForSecondDerivatives) {
  using Inner = Dual<Complex, 1>;
  const auto slope = [](const std::vector<Complex>& z) {  // d mixture / da
    Inner a(z[0]), b(z[1]);
    a.d[0] = Complex(1.0);
    return std::vector{mixture(a, b).d[0]};
  };
  Dual<Dual<double, 1>, 1> a{Dual<double, 1>(a0)}, b{Dual<double, 1>(b0)};
  a.d[0] = 1.0;
  b.v.d[0] = 1.0;
  EXPECT_NEAR(mixture(a, b).d[0].d[0], complex_step_along(slope, {a0, b0}, {0, 1})[0], 1e-13);
}

TEST(Dual, RootOfZeroSpeedHasNoSlope) {
  Dual<double, 1> zero(0.0);
  zero.d[0] = 1.0;
  EXPECT_EQ(sqrt_or_zero(zero).v, 0.0);
  EXPECT_EQ(sqrt_or_zero(zero).d[0], 0.0);
  Dual<double, 1> four(4.0);
  four.d[0] = 1.0;
  EXPECT_EQ(sqrt_or_zero(four).v, 2.0);
  EXPECT_EQ(sqrt_or_zero(four).d[0], 0.25);
}

TEST(Pack, LanesHaveTheBitsOfDouble) {
  Random random(1);
  Pack a, b;
  for (int lane = 0; lane < Pack::lanes; ++lane) a.set(lane, random(0.1, 3.0)), b.set(lane, random(0.1, 3.0));
  Dual<Pack, 1> da(a), db(b);
  da.d[0] = b;
  const Pack r = kernel_mixture(a, b);
  const Dual<Pack, 1> dr = kernel_mixture(da, db);
  for (int lane = 0; lane < Pack::lanes; ++lane) {
    EXPECT_TRUE(same_bits<double>({r[lane]}, {kernel_mixture(a[lane], b[lane])})) << "lane " << lane;
    Dual<double, 1> sa(a[lane]);
    sa.d[0] = b[lane];
    const Dual<double, 1> sr = kernel_mixture(sa, Dual<double, 1>(b[lane]));
    EXPECT_TRUE(same_bits<double>({dr.v[lane], dr.d[0][lane]}, {sr.v, sr.d[0]})) << "lane " << lane;
  }
}

TEST(Pack, ConstantsKeepTheirSign) {
  for (const double a : {0.0, -0.0, -1.5})
    for (int lane = 0; lane < Pack::lanes; ++lane) EXPECT_TRUE(same_bits<double>({Pack(a)[lane]}, {a})) << a;
}

TEST(Pack, OneBadLaneIsNotFinite) {
  Pack a(1.0);
  EXPECT_TRUE(all_finite(a));
  a.set(5, std::nan(""));
  EXPECT_FALSE(all_finite(a));
  EXPECT_FALSE(all_finite(Dual<Pack, 1>(a)));
}

TEST(Vec3, ProductsArePlain) {
  const Vec3<Complex> i{Complex(0, 1), 0.0, 0.0};
  EXPECT_EQ(dot(i, i).re, -1.0);
  const Vec3<double> a{1, 2, 3}, b{-2, 0.5, 4}, c = cross(a, b);
  EXPECT_EQ(dot(a, c), 0.0);
  EXPECT_EQ(dot(b, c), 0.0);
  EXPECT_EQ(c.x, 2 * 4 - 3 * 0.5);
}

}  // namespace
}  // namespace sheetbend::testing
