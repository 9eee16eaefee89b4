// First and second rung of the derivative ladder, and the physics of C, for every registered constraint.
#include "core/constraints/rest_values.h"
#include "core/scalar/complex.h"
#include "core/scalar/dual.h"
#include "tests/cpp/support/cases.h"
#include "tests/cpp/support/compare.h"
#include "tests/cpp/support/mutant.h"

namespace sheetbend::testing {
namespace {

constexpr int repetitions = 20;
using Dual1 = Dual<double, 1>;

// Coordinates in space: an internal variable, the last of a stencil that yields or has a dial, is none.
template <class K>
constexpr int spatial = Yields<K> || has_dial<K> ? K::dofs - 3 : K::dofs;
// Those with a unit of length: axes of bodies, which follow the points, have none.
template <class K>
constexpr int in_meters = K::axes > 0 ? 3 * K::points : spatial<K>;

struct Stencil {
  std::vector<double> x, p;
};

// The sample of a row, jittered.
template <class K>
Stencil jittered(unsigned seed) {
  const Case row = case_of<K>();
  Stencil s{row.x, row.p};
  Random random(seed);
  for (double& v : s.x) v += random(-0.01, 0.01);
  for (double& v : s.p) v += random(-0.02, 0.02);
  return s;
}

// C and J one after the other, at (x, p).
template <class K, class T>
std::vector<T> evaluate(const std::vector<T>& x, const std::vector<T>& p) {
  std::vector<T> out(K::rows + K::rows * K::dofs);
  K::evaluate(x.data(), p.data(), out.data(), out.data() + K::rows);
  return out;
}

template <class K, class T>
std::vector<T> evaluate_joined(const std::vector<T>& z) {
  return evaluate<K, T>({z.begin(), z.begin() + K::dofs}, {z.begin() + K::dofs, z.end()});
}

std::vector<double> joined(std::vector<double> a, const std::vector<double>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// d(C, J)/dt along a direction of (x, p), by one evaluation on duals.
template <class K>
std::vector<double> dual_along(const std::vector<double>& z, const std::vector<double>& v) {
  std::vector<Dual1> probe(z.size());
  for (std::size_t i = 0; i < z.size(); ++i) probe[i].v = z[i], probe[i].d[0] = v[i];
  std::vector<double> out;
  for (const Dual1& d : evaluate_joined<K, Dual1>(probe)) out.push_back(d.d[0]);
  return out;
}

std::vector<double> unit(std::size_t n, std::size_t i) {
  std::vector<double> e(n);
  e[i] = 1.0;
  return e;
}

// Worst relative error, over all coordinates' directions, of the gradient's derivative on duals against the
// complex step.
template <class K>
double hessian_error(const Stencil& s, const std::vector<double>& oracle_scale) {
  const std::vector<double> z = joined(s.x, s.p);
  double worst = 0.0;
  for (int d = 0; d < K::dofs; ++d) {
    const auto e = unit(z.size(), d);
    const auto found = dual_along<K>(z, e), oracle = complex_step_along(evaluate_joined<K, Complex>, z, e);
    for (std::size_t i = K::rows; i < found.size(); ++i) worst = std::max(worst, std::abs(found[i] - oracle[i]));
  }
  return worst == 0.0 ? 0.0 : worst / largest(oracle_scale);
}

// Hess(C_j) as rows (j, a, b), by duals.
template <class K>
std::vector<double> hessians(const Stencil& s) {
  std::vector<double> H(K::rows * K::dofs * K::dofs);
  const std::vector<double> z = joined(s.x, s.p);
  for (int b = 0; b < K::dofs; ++b) {
    const auto column = dual_along<K>(z, unit(z.size(), b));
    for (int j = 0; j < K::rows; ++j)
      for (int a = 0; a < K::dofs; ++a) H[(j * K::dofs + a) * K::dofs + b] = column[K::rows + j * K::dofs + a];
  }
  return H;
}

using Matrix3 = std::array<std::array<double, 3>, 3>;

Matrix3 rotation(Random& random) {
  std::vector<double> q = random.vector(4);
  const double n = std::sqrt(dot(q, q));
  for (double& v : q) v /= n;
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
           {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
           {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
}

std::vector<double> rotated(const Matrix3& R, const std::vector<double>& x) {
  std::vector<double> y(x.size());
  for (std::size_t i = 0; i < x.size(); ++i)
    for (int d = 0; d < 3; ++d) y[i] += R[i % 3][d] * x[i - i % 3 + d];
  return y;
}

template <class K>
class Constraint : public ::testing::Test {};
TYPED_TEST_SUITE(Constraint, RegistryTypes, KindName);

TYPED_TEST(Constraint, RowOfCasesFits) {
  using K = TypeParam;
  const Case c = case_of<K>();
  EXPECT_EQ(c.x.size(), std::size_t{K::dofs});
  for (const std::size_t size : {c.p.size(), c.parameter_sign.size()})
    EXPECT_EQ(size, static_cast<std::size_t>(parameter_count<K>));
  EXPECT_EQ(c.relabeling.size(), std::size_t{K::arity});
  EXPECT_EQ(c.sign.size(), std::size_t{K::rows});
  EXPECT_GT(c.compliance, 0.0);
  EXPECT_GT(c.damping, 0.0);
  EXPECT_TRUE(c.under_rotation == UnderRotation::stays || K::rows == 3);
}

TYPED_TEST(Constraint, GradientMatchesComplexStep) {
  using K = TypeParam;
  double worst = 0.0;
  for (unsigned seed = 0; seed < repetitions; ++seed) {
    const Stencil s = jittered<K>(seed);
    const std::vector<double> z = joined(s.x, s.p), value = evaluate_joined<K>(z);
    std::vector<double> oracle(K::rows * K::dofs);
    for (int d = 0; d < K::dofs; ++d) {
      const auto column = complex_step_along(evaluate_joined<K, Complex>, z, unit(z.size(), d));
      for (int j = 0; j < K::rows; ++j) oracle[j * K::dofs + d] = column[j];
    }
    worst = std::max(worst, relative_error(std::span(value).subspan(K::rows), oracle));
  }
  EXPECT_LE(worst, 1e-14);
  record_error("error", worst);
}

TYPED_TEST(Constraint, HessianMatchesComplexStepAndIsSymmetric) {
  using K = TypeParam;
  double worst = 0.0, asymmetry = 0.0;
  for (unsigned seed = 0; seed < repetitions; ++seed) {
    const Stencil s = jittered<K>(seed);
    const std::vector<double> H = hessians<K>(s);
    EXPECT_EQ(largest(H) > 0.0, case_of<K>().curved);
    worst = std::max(worst, hessian_error<K>(s, H));
    std::vector<double> transposed(H.size());
    for (int j = 0; j < K::rows; ++j)
      for (int a = 0; a < K::dofs; ++a)
        for (int b = 0; b < K::dofs; ++b)
          transposed[(j * K::dofs + b) * K::dofs + a] = H[(j * K::dofs + a) * K::dofs + b];
    asymmetry = std::max(asymmetry, relative_error(transposed, H));
  }
  EXPECT_LE(worst, 1e-13);
  EXPECT_LE(asymmetry, 1e-13);
  record_error("error", worst);
}

TYPED_TEST(Constraint, MutantHessianIsFlagged) {
  using K = TypeParam;
  const Stencil s = jittered<K>(1);
  EXPECT_EQ(hessian_error<Mutant<K>>(s, hessians<K>(s)) > 1e4 * 1e-13, case_of<K>().curved)
      << "only a linear C has nothing to get wrong";
}

TYPED_TEST(Constraint, ParameterDerivativesMatchComplexStep) {
  using K = TypeParam;
  for (unsigned seed = 0; seed < repetitions; ++seed) {
    const Stencil s = jittered<K>(seed);
    const std::vector<double> z = joined(s.x, s.p);
    for (int k = 0; k < parameter_count<K>; ++k) {
      const auto e = unit(z.size(), K::dofs + k);
      const auto found = dual_along<K>(z, e), oracle = complex_step_along(evaluate_joined<K, Complex>, z, e);
      if constexpr (requires { K::share_parameter; })
        if (k == K::yield_parameter) continue;  // acts in yield() alone
      EXPECT_GT(largest(std::span(oracle).first(K::rows)), 0.0) << K::parameters[k].name;
      EXPECT_LE(relative_error(std::span(found).first(K::rows), std::span(oracle).first(K::rows)), 1e-13)
          << K::parameters[k].name;
      EXPECT_LE(relative_error(std::span(found).subspan(K::rows), std::span(oracle).subspan(K::rows)), 1e-13)
          << K::parameters[k].name;
    }
  }
}

TYPED_TEST(Constraint, TranslationChangesNothing) {
  using K = TypeParam;
  const Stencil s = jittered<K>(2);
  std::vector<double> moved = s.x;
  for (int d = 0; d < 3 * K::points; ++d) moved[d] += d % 3 == 0 ? 0.5 : d % 3 == 1 ? -0.25 : 0.125;
  const auto before = evaluate<K>(s.x, s.p), after = evaluate<K>(moved, s.p);
  EXPECT_LE(relative_error(after, before), 1e-13);
  for (int j = 0; j < K::rows; ++j)
    for (int d = 0; d < 3; ++d) {
      double sum = 0.0;
      for (int k = 0; k < K::points; ++k) sum += before[K::rows + j * K::dofs + 3 * k + d];
      EXPECT_LE(std::abs(sum), 1e-14 * largest(std::span(before).subspan(K::rows))) << "row " << j;
    }
}

// Turning the stencil (and its normal) turns or keeps C. Infinitesimally, sum x cross g_j = C cross e_j or 0;
// with a normal inside C, which stays, only about that normal.
TYPED_TEST(Constraint, RotationTurnsOrKeepsC) {
  using K = TypeParam;
  const Case row = case_of<K>();
  const bool turns = row.under_rotation == UnderRotation::turns;
  Random random(3);
  for (unsigned seed = 0; seed < repetitions; ++seed) {
    const Stencil s = jittered<K>(seed);
    const Matrix3 R = rotation(random);
    std::vector<double> p = s.p, axis;
    if (row.normal >= 0) {
      axis.assign(p.begin() + row.normal, p.begin() + row.normal + 3);
      const auto normal = rotated(R, axis);
      std::copy(normal.begin(), normal.end(), p.begin() + row.normal);
    }
    std::vector<double> x = rotated(R, s.x);
    std::copy(s.x.begin() + spatial<K>, s.x.end(), x.begin() + spatial<K>);
    const auto before = evaluate<K>(s.x, s.p), after = evaluate<K>(x, p);
    const std::vector<double> C(before.begin(), before.begin() + K::rows);
    EXPECT_LE(relative_error(std::span(after).first(K::rows), turns ? rotated(R, C) : C), 1e-13);

    for (int j = 0; j < K::rows; ++j) {
      Vec3<double> torque;
      for (int k = 0; 3 * k < spatial<K>; ++k)
        torque = torque + cross(Vec3<double>(&s.x[3 * k]), Vec3<double>(&before[K::rows + j * K::dofs + 3 * k]));
      if constexpr (K::rows == 3)
        if (turns) torque = torque - cross(Vec3<double>(C.data()), Vec3<double>(unit(3, j).data()));
      if (!axis.empty()) torque = {dot(torque, Vec3<double>(axis.data())), 0.0, 0.0};
      EXPECT_LE(norm(torque), 1e-14 * largest(std::span(before).subspan(K::rows))) << "row " << j;
    }
  }
}

// C(s x) = s^meters C(x) when each parameter is scaled by s to the meters in its own unit, and a set as C: the header's units are right.
TYPED_TEST(Constraint, ScalesWithTheUnitOfLength) {
  using K = TypeParam;
  const auto meters = [](int d) { return d < in_meters<K> ? 1 : d < spatial<K> ? 0 : K::unit.meters; };
  for (const double scale : {1e-3, 7.0, 1e3}) {
    const Stencil s = jittered<K>(4);
    std::vector<double> x = s.x, p = s.p;
    for (int d = 0; d < K::dofs; ++d) x[d] *= std::pow(scale, meters(d));
    for (std::size_t k = 0; k < p.size(); ++k) p[k] *= std::pow(scale, K::parameters[k].unit.meters);
    std::vector<double> expected = evaluate<K>(s.x, s.p);
    for (int i = 0; i < static_cast<int>(expected.size()); ++i)
      expected[i] *= std::pow(scale, K::unit.meters - (i < K::rows ? 0 : meters((i - K::rows) % K::dofs)));
    const auto found = evaluate<K>(x, p);
    EXPECT_LE(relative_error(std::span(found).first(K::rows), std::span(expected).first(K::rows)), 1e-13);
    EXPECT_LE(relative_error(std::span(found).subspan(K::rows), std::span(expected).subspan(K::rows)), 1e-13);
  }
}

TYPED_TEST(Constraint, RelabelingGivesTheSameConstraint) {
  using K = TypeParam;
  const Case row = case_of<K>();
  const Stencil s = jittered<K>(5);
  std::vector<double> x(s.x.size()), p = s.p;
  // An internal variable belongs to C, so it takes C's signs.
  const auto sign = [&](int d) { return d >= spatial<K> && d - spatial<K> < K::rows ? row.sign[d - spatial<K>] : 1; };
  for (int d = 0; d < K::dofs; ++d) x[d] = sign(d) * s.x[3 * row.relabeling[d / 3] + d % 3];
  for (std::size_t k = 0; k < p.size(); ++k)
    p[k] = row.parameter_sign[k] * s.p[row.parameter_relabeling.empty() ? k : row.parameter_relabeling[k]];
  const auto before = evaluate<K>(s.x, s.p), after = evaluate<K>(x, p);
  std::vector<double> expected(before.size());
  for (int j = 0; j < K::rows; ++j) {
    expected[j] = row.sign[j] * before[j];
    for (int d = 0; d < K::dofs; ++d)
      expected[K::rows + j * K::dofs + d] =
          sign(d) * row.sign[j] * before[K::rows + j * K::dofs + 3 * row.relabeling[d / 3] + d % 3];
  }
  EXPECT_LE(relative_error(after, expected), 1e-14);
}

// What is measured leaves no strain; what has to be given is not a number, and so never zero unnoticed.
TYPED_TEST(Constraint, RestValuesAreMeasuredOrSaid) {
  using K = TypeParam;
  const Stencil s = jittered<K>(6);
  std::vector<double> p(parameter_count<K>), strained(K::rows), J(K::rows * K::dofs);
  rest_values<K>(s.x.data(), p.data());
  bool measured = false;
  for (int k = 0; k < parameter_count<K>; ++k) {
    const Default& otherwise = K::parameters[k].otherwise;
    const bool said = otherwise.source == Source::usual || otherwise.source == Source::preset;
    if (said) {
      EXPECT_EQ(p[k], otherwise.value) << K::parameters[k].name;
    }
    if (otherwise.source == Source::measured) {
      measured = true;
      EXPECT_TRUE(p[k] >= K::parameters[k].range.least && p[k] <= K::parameters[k].range.most) << K::parameters[k].name;
    } else if (!said) {
      EXPECT_TRUE(std::isnan(p[k])) << K::parameters[k].name;
    }
  }
  if (!measured || std::ranges::any_of(p, [](double v) { return std::isnan(v); })) return;
  K::evaluate(s.x.data(), p.data(), strained.data(), J.data());
  for (int j = 0; j < K::rows; ++j) EXPECT_EQ(strained[j], 0.0);
}

TEST(Registry, NamesAreDistinctAndKnown) {
  for_each_kind([]<class K>(K) {
    int same = 0;
    for_each_kind([&]<class L>(L) { same += std::string(K::name) == L::name; });
    EXPECT_EQ(same, 1) << K::name;
  });
  EXPECT_THROW(with_kind(kind_count, [](auto) {}), std::logic_error);
}

TEST(Hinge, AngleTakesTheShortWayRound) {
  const double pi = std::acos(-1.0);
  const std::vector<double> p{0, 0, 1, -0.9 * pi};
  for (const double theta : {0.95 * pi, 0.9 * pi}) {
    const std::vector<double> x{0, 0, 0, 1, 0, 0, 1 + std::cos(theta), std::sin(theta), 0};
    EXPECT_NEAR(evaluate<Hinge>(x, p)[0], theta + 0.9 * pi - 2 * pi, 1e-14);
  }
}

// dC/dtheta times C is the torque times the compliance: the angle while the joint sticks, the yield angle while it slides.
TEST(FrictionHinge, TorqueGrowsWithTheAngleUpToTheYieldAngleAndStays) {
  const double yield = 0.02, set = 0.3, arm = 2.0;
  for (const double angle : {-2.5, -0.1, -0.021, -0.019, -0.005, 0.005, 0.019, 0.021, 0.1, 2.5}) {
    const double theta = set + angle;
    const auto value = evaluate<FrictionHinge>(
        std::vector<double>{0, 0, 0, 1, 0, 0, 1 + arm * std::cos(theta), arm * std::sin(theta), 0, set, 0, 0},
        std::vector<double>{0, 0, 1, yield});
    const double slope = -value[1 + 9];  // the set moves against the angle
    EXPECT_NEAR(value[0] * slope, std::clamp(angle, -yield, yield), 1e-14) << angle;
    const double size = std::abs(angle), energy = size <= yield ? angle * angle : yield * (2.0 * size - yield);
    EXPECT_NEAR(value[0] * std::abs(value[0]), std::copysign(energy, angle), 1e-14);
  }
}

TEST(Distance, CoincidentParticlesHaveNoDirection) {
  const auto value = evaluate<Distance>(std::vector<double>(6, 0.3), std::vector<double>{0.1});
  EXPECT_EQ(value[0], -0.1);
  for (int d = 0; d < 6; ++d) EXPECT_EQ(value[1 + d], 0.0);
}

TEST(Bend, LengthIsTwiceTheTangentOfHalfTheAngle) {
  const double theta = 0.7;
  const auto value =
      evaluate<Bend>({0, 0, 0, 2, 0, 0, 2 + 3 * std::cos(theta), 3 * std::sin(theta), 0}, std::vector<double>{});
  EXPECT_NEAR(value[2], 2 * std::tan(theta / 2), 1e-15);
}

}  // namespace
}  // namespace sheetbend::testing
