// The air's force on one triangle against its formula, and its reverse against complex step.
#include "adjoint/step/apply_air_forces.h"
#include "core/scalar/complex.h"
#include "tests/cpp/support/compare.h"

namespace sheetbend::testing {
namespace {

template <class T>
AirTriangle<T> triangle(const std::vector<T>& a) {
  return {Vec3<T>(&a[0]), Vec3<T>(&a[3]), Vec3<T>(&a[6]), a[9], a[10], a[11]};
}

std::vector<double> force(const std::vector<double>& a) {
  const Vec3<double> f = AirForce<double>(triangle(a)).f;
  return {f.x, f.y, f.z};
}

std::vector<double> reverse(const std::vector<double>& a, const std::vector<double>& f_bar) {
  const AirTriangle<double> at = triangle(a);
  const AirTriangle<double> bar = air_force_vjp(at, AirForce<double>(at), Vec3<double>(f_bar.data()));
  std::vector<double> out(12);
  bar.e1.store(&out[0]), bar.e2.store(&out[3]), bar.u.store(&out[6]);
  out[9] = bar.normal, out[10] = bar.tangential, out[11] = bar.pressure;
  return out;
}

// An area of 3 in the plane z = 0.
std::vector<double> flat(double u, double v, double w, double p = 0.0) {
  return {2, 0, 0, 1, 3, 0, u, v, w, 0.7, 0.1, p};
}

TEST(AirForceOn, IsThatOfTheFormula) {
  EXPECT_LE(relative_error(force(flat(0, 0, -4)), std::vector<double>{0, 0, -3 * 0.7 * 16}), 1e-15);
  EXPECT_LE(relative_error(force(flat(3, 4, 0)), std::vector<double>{3 * 0.1 * 15, 3 * 0.1 * 20, 0}), 1e-15);
  EXPECT_LE(relative_error(force(flat(3, 4, -4)), std::vector<double>{4.5, 6, -33.6}), 1e-15);
  EXPECT_LE(relative_error(force(flat(0, 0, 0, 5)), std::vector<double>{0, 0, 15}), 1e-15);
}

TEST(AirForceOn, DoesNotKnowFrontFromBack) {
  Random random(1);
  const std::vector<double> a = random.vector(12);
  std::vector<double> turned = a;
  std::swap_ranges(turned.begin(), turned.begin() + 3, turned.begin() + 3);
  turned[11] = -a[11];  // but for pressure
  EXPECT_LE(relative_error(force(turned), force(a)), 1e-14);
}

TEST(AirForceOn, ReverseMatchesComplexStep) {
  Random random(2);
  double worst = 0.0;
  for (int i = 0; i < 100; ++i) {
    const std::vector<double> a = random.vector(12), f_bar = random.vector(3);
    const auto oracle = complex_step_gradient(
        [&](const std::vector<Complex>& z) {
          const Vec3<Complex> f = AirForce<Complex>(triangle(z)).f;
          return Complex(f_bar[0]) * f.x + Complex(f_bar[1]) * f.y + Complex(f_bar[2]) * f.z;
        },
        a);
    worst = std::max(worst, relative_error(reverse(a, f_bar), oracle));
  }
  EXPECT_LE(worst, 1e-12);
  record_error("air", worst);
}

// Still air, air along the normal or in the plane, and a triangle without area.
TEST(AirForceOn, IsSmoothWhereSpeedsVanish) {
  std::vector<double> line = flat(1, 2, 3);
  std::copy_n(line.begin(), 3, line.begin() + 3);
  for (const std::vector<double>& a : {flat(0, 0, 0), flat(0, 0, 1), flat(1, 2, 0), line})
    for (const double b : reverse(a, {1, 1, 1})) EXPECT_TRUE(std::isfinite(b));
  const std::vector<double> still = reverse(flat(0, 0, 0), {1, 1, 1});
  for (int i = 0; i < 11; ++i) EXPECT_EQ(still[i], 0.0);
  EXPECT_EQ(still[11], 3.0);  // the area
  for (const double f : force(line)) EXPECT_EQ(f, 0.0);
}

TEST(SceneInAir, NamesABadTriangle) {
  const auto build = [](const std::vector<std::array<int, 3>>& air, const std::vector<double>& times) {
    SceneSpec spec;
    spec.particles = 4;
    spec.directors = {{3, 0, 1}};
    spec.air = air;
    spec.wind = {times, Interpolation::linear};
    build_scene(spec);
  };
  EXPECT_NO_THROW(build({{0, 1, 2}}, {0.0}));
  EXPECT_THROW(build({{0, 1, 7}}, {0.0}), std::invalid_argument);
  EXPECT_THROW(build({{0, 1, 1}}, {0.0}), std::invalid_argument);
  EXPECT_THROW(build({{0, 1, 3}}, {0.0}), std::invalid_argument);
  EXPECT_THROW(build({{0, 1, 2}}, {}), std::invalid_argument);
  EXPECT_THROW(build({{0, 1, 2}}, {1.0, 0.0}), std::invalid_argument);
}

}  // namespace
}  // namespace sheetbend::testing
