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

// A kind as numbers and functions, so that each test is compiled once and not once per kind.
struct Kind {
  const char* name;
  int rows, dofs, points;
  int spatial;  // coordinates in space: an internal variable, the last of a stencil that yields or has a dial, is none
  int in_meters;  // those with a unit of length: axes of bodies, which follow the points, have none
  Unit unit;
  std::span<const Parameter> parameters;
  int acts_in_yield;  // the parameter that acts in yield() alone, or -1
  Case row;
  void (*evaluate)(const double* x, const double* p, double* C, double* J);
  void (*evaluate_complex)(const Complex* x, const Complex* p, Complex* C, Complex* J);
  void (*evaluate_dual)(const Dual1* x, const Dual1* p, Dual1* C, Dual1* J);
  void (*evaluate_mutant)(const Dual1* x, const Dual1* p, Dual1* C, Dual1* J);
  void (*rest_values)(const double* x, double* p);
};

template <class K, class T>
[[gnu::noinline]] void evaluate_kind(const T* x, const T* p, T* C, T* J) {
  K::evaluate(x, p, C, J);
}

template <class K>
Kind kind_of() {
  constexpr int numbers = Yields<K> ? set_nodes<K> : has_dial<K> ? 1 : 0, spatial = K::dofs - 3 * numbers;
  Kind kind{.name = K::name,
            .rows = K::rows,
            .dofs = K::dofs,
            .points = K::points,
            .spatial = spatial,
            .in_meters = K::axes > 0 ? 3 * K::points : spatial,
            .unit = K::unit,
            .parameters = K::parameters,
            .acts_in_yield = -1,
            .row = case_of<K>(),
            .evaluate = evaluate_kind<K, double>,
            .evaluate_complex = evaluate_kind<K, Complex>,
            .evaluate_dual = evaluate_kind<K, Dual1>,
            .evaluate_mutant = Mutant<K>::template evaluate<double, 1>,
            .rest_values = rest_values<K>};
  if constexpr (requires { K::share_parameter; }) kind.acts_in_yield = K::yield_parameter;
  return kind;
}

struct Stencil {
  std::vector<double> x, p;
};

// The sample of a row, jittered.
Stencil jittered(const Kind& kind, unsigned seed) {
  Stencil s{kind.row.x, kind.row.p};
  Random random(seed);
  for (double& v : s.x) v += random(-0.01, 0.01);
  for (double& v : s.p) v += random(-0.02, 0.02);
  return s;
}

// C and J one after the other, at (x, p).
std::vector<double> evaluate(const Kind& kind, const std::vector<double>& x, const std::vector<double>& p) {
  std::vector<double> out(kind.rows + kind.rows * kind.dofs);
  kind.evaluate(x.data(), p.data(), out.data(), out.data() + kind.rows);
  return out;
}

std::vector<double> joined(std::vector<double> a, const std::vector<double>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// d(C, J)/dt along a direction of (x, p), by a complex step.
std::vector<double> complex_along(const Kind& kind, const std::vector<double>& z, const std::vector<double>& v) {
  const auto at = [&](const std::vector<Complex>& probe) {
    std::vector<Complex> out(kind.rows + kind.rows * kind.dofs);
    kind.evaluate_complex(probe.data(), probe.data() + kind.dofs, out.data(), out.data() + kind.rows);
    return out;
  };
  return complex_step_along(at, z, v);
}

// The same by one evaluation on duals.
std::vector<double> dual_along(const Kind& kind, decltype(Kind::evaluate_dual) evaluate, const std::vector<double>& z,
                               const std::vector<double>& v) {
  std::vector<Dual1> probe(z.size()), value(kind.rows + kind.rows * kind.dofs);
  for (std::size_t i = 0; i < z.size(); ++i) probe[i].v = z[i], probe[i].d[0] = v[i];
  evaluate(probe.data(), probe.data() + kind.dofs, value.data(), value.data() + kind.rows);
  std::vector<double> out;
  for (const Dual1& d : value) out.push_back(d.d[0]);
  return out;
}

std::vector<double> unit(std::size_t n, std::size_t i) {
  std::vector<double> e(n);
  e[i] = 1.0;
  return e;
}

// Worst relative error, over all coordinates' directions, of the gradient's derivative on duals against the
// complex step.
double hessian_error(const Kind& kind, decltype(Kind::evaluate_dual) evaluate, const Stencil& s,
                     const std::vector<double>& oracle_scale) {
  const std::vector<double> z = joined(s.x, s.p);
  double worst = 0.0;
  for (int d = 0; d < kind.dofs; ++d) {
    const auto e = unit(z.size(), d);
    const auto found = dual_along(kind, evaluate, z, e), oracle = complex_along(kind, z, e);
    for (std::size_t i = kind.rows; i < found.size(); ++i) worst = std::max(worst, std::abs(found[i] - oracle[i]));
  }
  return worst == 0.0 ? 0.0 : worst / largest(oracle_scale);
}

// Hess(C_j) as rows (j, a, b), by duals.
std::vector<double> hessians(const Kind& kind, const Stencil& s) {
  std::vector<double> H(kind.rows * kind.dofs * kind.dofs);
  const std::vector<double> z = joined(s.x, s.p);
  for (int b = 0; b < kind.dofs; ++b) {
    const auto column = dual_along(kind, kind.evaluate_dual, z, unit(z.size(), b));
    for (int j = 0; j < kind.rows; ++j)
      for (int a = 0; a < kind.dofs; ++a)
        H[(j * kind.dofs + a) * kind.dofs + b] = column[kind.rows + j * kind.dofs + a];
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

struct Constraint : ::testing::TestWithParam<Kind> {};
INSTANTIATE_TEST_SUITE_P(, Constraint, ::testing::ValuesIn([]<class... K>(std::tuple<K...>*) {
                           return std::vector<Kind>{kind_of<K>()...};
                         }(static_cast<TestedKinds*>(nullptr))),
                         [](const auto& info) { return info.param.name; });

TEST_P(Constraint, RowOfCasesFits) {
  const Kind& kind = GetParam();
  const Case& c = kind.row;
  EXPECT_EQ(c.x.size(), static_cast<std::size_t>(kind.dofs));
  for (const std::size_t size : {c.p.size(), c.parameter_sign.size()}) EXPECT_EQ(size, kind.parameters.size());
  EXPECT_EQ(c.relabeling.size(), static_cast<std::size_t>(kind.dofs / 3));
  EXPECT_EQ(c.sign.size(), static_cast<std::size_t>(kind.rows));
  EXPECT_GT(c.compliance, 0.0);
  EXPECT_GT(c.damping, 0.0);
  EXPECT_TRUE(c.under_rotation == UnderRotation::stays || kind.rows == 3);
}

TEST_P(Constraint, GradientMatchesComplexStep) {
  const Kind& kind = GetParam();
  double worst = 0.0;
  for (unsigned seed = 0; seed < repetitions; ++seed) {
    const Stencil s = jittered(kind, seed);
    const std::vector<double> z = joined(s.x, s.p), value = evaluate(kind, s.x, s.p);
    std::vector<double> oracle(kind.rows * kind.dofs);
    for (int d = 0; d < kind.dofs; ++d) {
      const auto column = complex_along(kind, z, unit(z.size(), d));
      for (int j = 0; j < kind.rows; ++j) oracle[j * kind.dofs + d] = column[j];
    }
    worst = std::max(worst, relative_error(std::span(value).subspan(kind.rows), oracle));
  }
  EXPECT_LE(worst, 1e-14);
  record_error("error", worst);
}

TEST_P(Constraint, HessianMatchesComplexStepAndIsSymmetric) {
  const Kind& kind = GetParam();
  double worst = 0.0, asymmetry = 0.0;
  for (unsigned seed = 0; seed < repetitions; ++seed) {
    const Stencil s = jittered(kind, seed);
    const std::vector<double> H = hessians(kind, s);
    EXPECT_EQ(largest(H) > 0.0, kind.row.curved);
    worst = std::max(worst, hessian_error(kind, kind.evaluate_dual, s, H));
    std::vector<double> transposed(H.size());
    for (int j = 0; j < kind.rows; ++j)
      for (int a = 0; a < kind.dofs; ++a)
        for (int b = 0; b < kind.dofs; ++b)
          transposed[(j * kind.dofs + b) * kind.dofs + a] = H[(j * kind.dofs + a) * kind.dofs + b];
    asymmetry = std::max(asymmetry, relative_error(transposed, H));
  }
  EXPECT_LE(worst, 1e-13);
  EXPECT_LE(asymmetry, 1e-13);
  record_error("error", worst);
}

TEST_P(Constraint, MutantHessianIsFlagged) {
  const Kind& kind = GetParam();
  const Stencil s = jittered(kind, 1);
  EXPECT_EQ(hessian_error(kind, kind.evaluate_mutant, s, hessians(kind, s)) > 1e4 * 1e-13, kind.row.curved)
      << "only a linear C has nothing to get wrong";
}

TEST_P(Constraint, ParameterDerivativesMatchComplexStep) {
  const Kind& kind = GetParam();
  for (unsigned seed = 0; seed < repetitions; ++seed) {
    const Stencil s = jittered(kind, seed);
    const std::vector<double> z = joined(s.x, s.p);
    for (int k = 0; k < static_cast<int>(kind.parameters.size()); ++k) {
      const auto e = unit(z.size(), kind.dofs + k);
      const auto found = dual_along(kind, kind.evaluate_dual, z, e), oracle = complex_along(kind, z, e);
      if (k == kind.acts_in_yield) continue;
      EXPECT_GT(largest(std::span(oracle).first(kind.rows)), 0.0) << kind.parameters[k].name;
      EXPECT_LE(relative_error(std::span(found).first(kind.rows), std::span(oracle).first(kind.rows)), 1e-13)
          << kind.parameters[k].name;
      EXPECT_LE(relative_error(std::span(found).subspan(kind.rows), std::span(oracle).subspan(kind.rows)), 1e-13)
          << kind.parameters[k].name;
    }
  }
}

TEST_P(Constraint, TranslationChangesNothing) {
  const Kind& kind = GetParam();
  const Stencil s = jittered(kind, 2);
  std::vector<double> moved = s.x;
  for (int d = 0; d < 3 * kind.points; ++d) moved[d] += d % 3 == 0 ? 0.5 : d % 3 == 1 ? -0.25 : 0.125;
  const auto before = evaluate(kind, s.x, s.p), after = evaluate(kind, moved, s.p);
  EXPECT_LE(relative_error(after, before), 1e-13);
  for (int j = 0; j < kind.rows; ++j)
    for (int d = 0; d < 3; ++d) {
      double sum = 0.0;
      for (int k = 0; k < kind.points; ++k) sum += before[kind.rows + j * kind.dofs + 3 * k + d];
      EXPECT_LE(std::abs(sum), 1e-14 * largest(std::span(before).subspan(kind.rows))) << "row " << j;
    }
}

// Turning the stencil (and its normal) turns or keeps C. Infinitesimally, sum x cross g_j = C cross e_j or 0;
// with a normal inside C, which stays, only about that normal.
TEST_P(Constraint, RotationTurnsOrKeepsC) {
  const Kind& kind = GetParam();
  const Case& row = kind.row;
  const bool turns = row.under_rotation == UnderRotation::turns;
  Random random(3);
  for (unsigned seed = 0; seed < repetitions; ++seed) {
    const Stencil s = jittered(kind, seed);
    const Matrix3 R = rotation(random);
    std::vector<double> p = s.p, axis;
    if (row.normal >= 0) {
      axis.assign(p.begin() + row.normal, p.begin() + row.normal + 3);
      const auto normal = rotated(R, axis);
      std::copy(normal.begin(), normal.end(), p.begin() + row.normal);
    }
    std::vector<double> x = rotated(R, s.x);
    std::copy(s.x.begin() + kind.spatial, s.x.end(), x.begin() + kind.spatial);
    const auto before = evaluate(kind, s.x, s.p), after = evaluate(kind, x, p);
    const std::vector<double> C(before.begin(), before.begin() + kind.rows);
    EXPECT_LE(relative_error(std::span(after).first(kind.rows), turns ? rotated(R, C) : C), 1e-13);

    for (int j = 0; j < kind.rows; ++j) {
      Vec3<double> torque;
      for (int k = 0; 3 * k < kind.spatial; ++k)
        torque = torque + cross(Vec3<double>(&s.x[3 * k]), Vec3<double>(&before[kind.rows + j * kind.dofs + 3 * k]));
      if (turns) torque = torque - cross(Vec3<double>(C.data()), Vec3<double>(unit(3, j).data()));
      if (!axis.empty()) torque = {dot(torque, Vec3<double>(axis.data())), 0.0, 0.0};
      EXPECT_LE(norm(torque), 1e-14 * largest(std::span(before).subspan(kind.rows))) << "row " << j;
    }
  }
}

// C(s x) = s^meters C(x) when each parameter is scaled by s to the meters in its own unit, and a set as C: the header's units are right.
TEST_P(Constraint, ScalesWithTheUnitOfLength) {
  const Kind& kind = GetParam();
  const auto meters = [&](int d) { return d < kind.in_meters ? 1 : d < kind.spatial ? 0 : kind.unit.meters; };
  for (const double scale : {1e-3, 7.0, 1e3}) {
    const Stencil s = jittered(kind, 4);
    std::vector<double> x = s.x, p = s.p;
    for (int d = 0; d < kind.dofs; ++d) x[d] *= std::pow(scale, meters(d));
    for (std::size_t k = 0; k < p.size(); ++k) p[k] *= std::pow(scale, kind.parameters[k].unit.meters);
    std::vector<double> expected = evaluate(kind, s.x, s.p);
    for (int i = 0; i < static_cast<int>(expected.size()); ++i)
      expected[i] *= std::pow(scale, kind.unit.meters - (i < kind.rows ? 0 : meters((i - kind.rows) % kind.dofs)));
    const auto found = evaluate(kind, x, p);
    EXPECT_LE(relative_error(std::span(found).first(kind.rows), std::span(expected).first(kind.rows)), 1e-13);
    EXPECT_LE(relative_error(std::span(found).subspan(kind.rows), std::span(expected).subspan(kind.rows)), 1e-13);
  }
}

TEST_P(Constraint, RelabelingGivesTheSameConstraint) {
  const Kind& kind = GetParam();
  const Case& row = kind.row;
  const Stencil s = jittered(kind, 5);
  std::vector<double> x(s.x.size()), p = s.p;
  // An internal variable belongs to C, so it takes C's signs.
  const auto sign = [&](int d) {
    return d >= kind.spatial && d - kind.spatial < kind.rows ? row.sign[d - kind.spatial] : 1;
  };
  for (int d = 0; d < kind.dofs; ++d) x[d] = sign(d) * s.x[3 * row.relabeling[d / 3] + d % 3];
  for (std::size_t k = 0; k < p.size(); ++k)
    p[k] = row.parameter_sign[k] * s.p[row.parameter_relabeling.empty() ? k : row.parameter_relabeling[k]];
  const auto before = evaluate(kind, s.x, s.p), after = evaluate(kind, x, p);
  std::vector<double> expected(before.size());
  for (int j = 0; j < kind.rows; ++j) {
    expected[j] = row.sign[j] * before[j];
    for (int d = 0; d < kind.dofs; ++d)
      expected[kind.rows + j * kind.dofs + d] =
          sign(d) * row.sign[j] * before[kind.rows + j * kind.dofs + 3 * row.relabeling[d / 3] + d % 3];
  }
  EXPECT_LE(relative_error(after, expected), 1e-14);
}

// What is measured leaves no strain; what has to be given is not a number, and so never zero unnoticed.
TEST_P(Constraint, RestValuesAreMeasuredOrSaid) {
  const Kind& kind = GetParam();
  const Stencil s = jittered(kind, 6);
  std::vector<double> p(kind.parameters.size()), strained(kind.rows), J(kind.rows * kind.dofs);
  kind.rest_values(s.x.data(), p.data());
  bool measured = false;
  for (int k = 0; k < static_cast<int>(kind.parameters.size()); ++k) {
    const Default& otherwise = kind.parameters[k].otherwise;
    const bool said = otherwise.source == Source::usual || otherwise.source == Source::preset;
    if (said) {
      EXPECT_EQ(p[k], otherwise.value) << kind.parameters[k].name;
    }
    if (otherwise.source == Source::measured) {
      measured = true;
      EXPECT_TRUE(p[k] >= kind.parameters[k].range.least && p[k] <= kind.parameters[k].range.most)
          << kind.parameters[k].name;
    } else if (!said) {
      EXPECT_TRUE(std::isnan(p[k])) << kind.parameters[k].name;
    }
  }
  if (!measured || std::ranges::any_of(p, [](double v) { return std::isnan(v); })) return;
  kind.evaluate(s.x.data(), p.data(), strained.data(), J.data());
  for (int j = 0; j < kind.rows; ++j) EXPECT_EQ(strained[j], 0.0);
}

TEST(Registry, NamesAreDistinctAndKnown) {
  std::vector<std::string> names;
  for_each_kind([&]<class K>(K) { names.push_back(K::name); });
  for (const std::string& name : names) EXPECT_EQ(std::ranges::count(names, name), 1) << name;
  EXPECT_THROW(with_kind(kind_count, [](auto) {}), std::logic_error);
}

TEST(Hinge, AngleTakesTheShortWayRound) {
  const double pi = std::acos(-1.0);
  const std::vector<double> p{0, 0, 1, -0.9 * pi};
  for (const double theta : {0.95 * pi, 0.9 * pi}) {
    const std::vector<double> x{0, 0, 0, 1, 0, 0, 1 + std::cos(theta), std::sin(theta), 0};
    EXPECT_NEAR(evaluate(kind_of<Hinge>(), x, p)[0], theta + 0.9 * pi - 2 * pi, 1e-14);
  }
}

// dC/dtheta times C is the torque times the compliance: the angle while the joint sticks, the yield angle while it slides.
TEST(FrictionHinge, TorqueGrowsWithTheAngleUpToTheYieldAngleAndStays) {
  const double yield = 0.02, set = 0.3, arm = 2.0;
  for (const double angle : {-2.5, -0.1, -0.021, -0.019, -0.005, 0.005, 0.019, 0.021, 0.1, 2.5}) {
    const double theta = set + angle;
    const auto value =
        evaluate(kind_of<FrictionHinge>(),
                 std::vector<double>{0, 0, 0, 1, 0, 0, 1 + arm * std::cos(theta), arm * std::sin(theta), 0, set, 0, 0},
                 std::vector<double>{0, 0, 1, yield});
    const double slope = -value[1 + 9];  // the set moves against the angle
    EXPECT_NEAR(value[0] * slope, std::clamp(angle, -yield, yield), 1e-14) << angle;
    const double size = std::abs(angle), energy = size <= yield ? angle * angle : yield * (2.0 * size - yield);
    EXPECT_NEAR(value[0] * std::abs(value[0]), std::copysign(energy, angle), 1e-14);
  }
}

TEST(Distance, CoincidentParticlesHaveNoDirection) {
  const auto value = evaluate(kind_of<Distance>(), std::vector<double>(6, 0.3), std::vector<double>{0.1});
  EXPECT_EQ(value[0], -0.1);
  for (int d = 0; d < 6; ++d) EXPECT_EQ(value[1 + d], 0.0);
}

TEST(Bend, LengthIsTwiceTheTangentOfHalfTheAngle) {
  const double theta = 0.7;
  const auto value = evaluate(kind_of<Bend>(), {0, 0, 0, 2, 0, 0, 2 + 3 * std::cos(theta), 3 * std::sin(theta), 0},
                              std::vector<double>{});
  EXPECT_NEAR(value[2], 2 * std::tan(theta / 2), 1e-15);
}

}  // namespace
}  // namespace sheetbend::testing
