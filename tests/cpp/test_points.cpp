// What a substep does point by point: lanes and duals have the values of plain numbers, to the bit and on every instruction set, and the
// directions of duals are those of a complex step.
#include "core/packs/packed_colors.h"
#include "core/points/point_kernels.h"
#include "core/scalar/complex.h"
#include "tests/cpp/support/compare.h"

namespace sheetbend::testing {
namespace {

constexpr int points = 6;
// Coordinates at n and n-1, masses and both drags, gravity, wind.
constexpr int inputs = 4 * 3 * points + 3 * points + 6;
// A director on the edge from point 0 to 1, a normal, and the director about it.
constexpr sheetbend_points::Frame frames[] = {{9, 0, 3}, {12, -1, 12}, {15, -1, 12}};
constexpr char inertial[points] = {1, 1, 0, 0, 0, 0}, director[points] = {0, 0, 0, 1, 1, 1};
constexpr char has_weight[points] = {1, 0, 0, 0, 0, 0};  // of which wind blows on what has drag

template <class T>
std::vector<T> run(const sheetbend_points::Kernels& kernels, const std::vector<T>& in, bool second_order, int stride) {
  std::vector<T> out(2 * points + 3 * stride * points + 3, T(0.0));
  const auto from = [&](int i) { return reinterpret_cast<const double*>(in.data() + i); };
  const auto to = [&](int i) { return reinterpret_cast<double*>(out.data() + i); };
  const double eta = second_order ? 1.0 / 3.0 : 0.5;
  sheetbend_points::Points p{};
  p.eta = eta;
  p.now = second_order ? 4.0 / 3.0 : 1.0;
  p.before = second_order ? -1.0 / 3.0 : 0.0;
  p.extrapolate_now = second_order ? 2.0 : 1.0;
  p.extrapolate_before = second_order ? -1.0 : 0.0;
  p.inertial = inertial;
  p.director = director;
  p.has_weight = has_weight;
  p.x = from(0);
  p.x_before = from(3 * points);
  p.v = from(6 * points);
  p.v_before = from(9 * points);
  p.mass = from(12 * points);
  p.drag_linear = from(13 * points);
  p.drag_quadratic = from(14 * points);
  p.gravity = from(15 * points);
  p.wind = from(15 * points + 3);
  p.w = to(0);
  p.kept = to(points);
  p.q = to(2 * points);
  p.stride = stride;
  p.x_next = to(2 * points + stride * points);
  p.v_next = to(2 * points + 2 * stride * points);
  kernels.effective_masses(p, 0, points);
  kernels.predict(p, 0, points);
  EXPECT_TRUE(kernels.update_velocities(p, 0, points));
  kernels.retract(frames, std::size(frames), p.x_next);
  const double weight[] = {0.25, 1.5, -0.75};
  kernels.interpolate(p.x, 3, weight, std::size(weight), to(2 * points + 3 * stride * points));
  return out;
}

struct PointsOfASubstep : ::testing::TestWithParam<std::tuple<bool, int>> {
  template <class T>
  std::vector<T> run(const sheetbend_points::Kernels& kernels, const std::vector<T>& in) const {
    return testing::run(kernels, in, std::get<0>(GetParam()), std::get<1>(GetParam()));
  }

  static std::vector<double> random_inputs(int seed) { return Random(seed).vector(inputs, 0.2, 2.0); }
};

INSTANTIATE_TEST_SUITE_P(, PointsOfASubstep, ::testing::Combine(::testing::Bool(), ::testing::Values(3, 4)));

TEST_P(PointsOfASubstep, AreTheSameInEveryLane) {
  std::vector<std::vector<double>> each;
  for (int lane = 0; lane < Pack::lanes; ++lane) each.push_back(random_inputs(lane));
  std::vector<Pack> packed;
  for (int i = 0; i < inputs; ++i) packed.push_back(per_lane([&](int lane) { return each[lane][i]; }));
  for (const auto* kernels : available_kernels()) {
    const auto found = run(kernels->points->lanes, packed);
    for (int lane = 0; lane < Pack::lanes; ++lane) {
      std::vector<double> own;
      for (const Pack& a : found) own.push_back(a[lane]);
      EXPECT_TRUE(same_bits(own, run(PointKernels<double>::all, each[lane]))) << kernels->name << ", lane " << lane;
    }
  }
}

template <int N>
void expect_directions(const PointsOfASubstep& test, sheetbend_points::Kernels sheetbend_points::Table::* kernels_of) {
  const auto theta = test.random_inputs(20);
  std::vector<Dual<double, N>> duals(theta.begin(), theta.end());
  for (int k = 0; k < N; ++k)
    for (int i = 0; i < inputs; ++i) duals[i].d[k] = test.random_inputs(30 + k)[i];
  for (const auto* kernels : available_kernels()) {
    const auto found = test.run(kernels->points->*kernels_of, duals);
    std::vector<double> values;
    for (const auto& a : found) values.push_back(a.v);
    EXPECT_TRUE(same_bits(values, test.run(PointKernels<double>::all, theta))) << kernels->name;
    for (int k = 0; k < N; ++k) {
      std::vector<double> directions;
      for (const auto& a : found) directions.push_back(a.d[k]);
      const auto oracle =
          complex_step_along([&](const std::vector<Complex>& z) { return test.run(PointKernels<Complex>::all, z); },
                             theta, test.random_inputs(30 + k));
      EXPECT_LE(relative_error(directions, oracle), 1e-14) << kernels->name << ", direction " << k;
    }
  }
}

TEST_P(PointsOfASubstep, HaveTheDirectionsOfAComplexStep) {
  expect_directions<4>(*this, &sheetbend_points::Table::four_directions);
  expect_directions<8>(*this, &sheetbend_points::Table::eight_directions);
}

TEST_P(PointsOfASubstep, TellWhatIsNotFinite) {
  std::vector<Pack> packed(inputs, Pack(1.0));
  sheetbend_points::Points p{};
  std::vector<Pack> out(2 * inputs, Pack(0.0));
  p.eta = 1.0;
  p.now = 1.0;
  p.stride = std::get<1>(GetParam());
  p.x = p.x_before = p.q = reinterpret_cast<double*>(packed.data());
  p.x_next = reinterpret_cast<double*>(out.data());
  p.v_next = reinterpret_cast<double*>(out.data() + inputs);
  for (const auto* kernels : available_kernels()) {
    EXPECT_TRUE(kernels->points->lanes.update_velocities(p, 0, points)) << kernels->name;
    for (const double bad : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
      for (int lane = 0; lane < Pack::lanes; ++lane) {
        Pack& last = packed[p.stride * (points - 1) + 2];
        last.set(lane, bad);
        EXPECT_FALSE(kernels->points->lanes.update_velocities(p, 0, points)) << kernels->name << ", lane " << lane;
        last.set(lane, 1.0);
      }
  }
}

}  // namespace
}  // namespace sheetbend::testing
