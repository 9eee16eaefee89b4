// Rigid constraints that follow from others: a flat net of squares with both diagonals moves as without the redundant ones, has the derivatives of
// that motion in every scalar, and its redundant rows are named.
#include "core/rollout/redundant_rows.h"

#include "core/scalar/dual.h"
#include "tests/cpp/support/lanes.h"

namespace sheetbend::testing {
namespace {

constexpr double edge = 0.1;
const Vec3<double> across(0.6, 0.8, 0.0), down(0.48, -0.36, -0.8), normal = cross(across, down);

// cells x cells squares in a plane that is no coordinate's, of rigid links with both diagonals. Its first particle is pinned.
Sample net(int cells, double bulge = 0.0) {
  const int side = cells + 1;
  SceneSpec spec;
  spec.particles = side * side;
  spec.pinned = {0};
  std::vector<int> pairs;
  const auto at = [&](int i, int j) { return i * side + j; };
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j) {
      if (j < cells) pairs.insert(pairs.end(), {at(i, j), at(i, j + 1)});
      if (i < cells) pairs.insert(pairs.end(), {at(i, j), at(i + 1, j)});
      if (i < cells && j < cells) pairs.insert(pairs.end(), {at(i, j), at(i + 1, j + 1), at(i, j + 1), at(i + 1, j)});
    }
  spec.groups = {{"links", "distance", false, pairs}};
  Sample sample{build_scene(spec), {}};
  sample.inputs.resize(sample.scene.layout.total());
  const Inputs<double> in{sample.scene.layout, sample.inputs.data()};
  double* x = in.of(Quantity::position);
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j) {
      const int n = at(i, j);
      (edge * i * down + edge * j * across + bulge * std::sin(1.0 + 2.0 * n) * normal).store(x + 3 * n);
      in.of(Quantity::mass)[n] = 0.1 + 0.02 * std::cos(3.0 * n);
    }
  for (std::size_t k = 0; k < pairs.size() / 2; ++k)
    in.of(Quantity::rest)[k] = norm(Vec3<double>(x + 3 * pairs[2 * k]) - Vec3<double>(x + 3 * pairs[2 * k + 1]));
  (9.81 * (across + 0.2 * down)).store(in.of(Quantity::gravity));  // in the plane
  return sample;
}

// Of what a motion depends on. Out of its plane the net's links have more to say, which derivatives at the plane know nothing of: differences stay
// in it.
std::vector<double> some_direction(const Sample& s, unsigned seed, bool in_plane = false) {
  const Layout& layout = s.scene.layout;
  std::vector<double> v(layout.total());
  Random random(seed);
  for (const Quantity q : {Quantity::position, Quantity::velocity, Quantity::mass, Quantity::rest, Quantity::gravity})
    for (std::size_t i = 0; i < layout.count(q); ++i) v[layout.of(q) + i] = 0.1 * random(-1.0, 1.0);
  if (!in_plane) return v;
  for (const Quantity q : {Quantity::position, Quantity::velocity, Quantity::gravity})
    for (double* a = v.data() + layout.of(q); a < v.data() + layout.of(q) + layout.count(q); a += 3)
      (-dot(Vec3<double>(a), normal) * normal).add_to(a);
  return v;
}

struct RedundantRows : ::testing::TestWithParam<int> {
  Sample sample = net(GetParam());
  Program program{sample.scene, make_plan(sample.scene, {.h = 2e-3, .partition = Partition::direct}), 8};
};
// One square, and one net whose factor is no band.
INSTANTIATE_TEST_SUITE_P(, RedundantRows, ::testing::Values(1, 9));

TEST_P(RedundantRows, LeaveTheLinksTheirLengths) {
  EXPECT_EQ(program.plan.blocks.at(0).banded(), GetParam() == 1);
  const auto all = states(program, sample.inputs);
  const double* x = all.data() + program.steps * sample.scene.dofs();
  const Inputs<const double> in{sample.scene.layout, sample.inputs.data()};
  const Group& links = sample.scene.groups[0];
  double moved = 0.0;
  for (int i = 0; i < sample.scene.dofs(); ++i) moved = std::max(moved, std::abs(x[i] - all[i]));
  EXPECT_GT(moved, 1e-4);
  for (int k = 0; k < links.count; ++k) {
    const auto nodes = links.nodes(k);
    EXPECT_NEAR(norm(Vec3<double>(x + 3 * nodes[0]) - Vec3<double>(x + 3 * nodes[1])), in.of(Quantity::rest)[k], 1e-12)
        << "link " << k;
  }
}

double product(const std::vector<double>& a, const std::vector<double>& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

TEST_P(RedundantRows, HaveTheGradientOfTheMotion) {
  const auto reverse = gradient(program, sample.inputs);
  for (const double a : reverse) ASSERT_LT(std::abs(a), 1e4);
  for (const unsigned seed : {1u, 2u}) {
    const auto v = some_direction(sample, seed), in_plane = some_direction(sample, seed, true);
    const auto losses = [&](const std::vector<Complex>& in) { return std::vector{loss(program, in)}; };
    const double step = complex_step_along(losses, sample.inputs, v)[0];
    EXPECT_NEAR(product(reverse, v), step, 1e-9 * std::abs(step));
    const auto moved = [&](double size) {
      std::vector<double> in = sample.inputs;
      for (std::size_t i = 0; i < in.size(); ++i) in[i] += size * in_plane[i];
      return loss(program, in);
    };
    const double coarse = (moved(2e-5) - moved(-2e-5)) / 4e-5, fine = (moved(1e-5) - moved(-1e-5)) / 2e-5;
    EXPECT_NEAR(product(reverse, in_plane), (4.0 * fine - coarse) / 3.0, 1e-6 * std::abs(fine));
  }
}

TEST_P(RedundantRows, HaveTheTangentsOfTheMotion) {
  using D = Dual<double, 8>;
  std::vector<D> in(sample.inputs.begin(), sample.inputs.end());
  std::vector<std::vector<double>> v;
  for (int k = 0; k < D::directions; ++k) {
    v.push_back(some_direction(sample, 5 + k));
    for (std::size_t i = 0; i < in.size(); ++i) in[i].d[k] = v[k][i];
  }
  const auto forward = states(program, in);
  const auto oracle =
      complex_step_along([&](const std::vector<Complex>& z) { return states(program, z); }, sample.inputs, v[2]);
  std::vector<double> found;
  for (const D& a : forward) found.push_back(a.d[2]);
  EXPECT_LE(relative_error(found, oracle), 1e-9);
}

// Lanes whose net is bulged have all of their rows, the others beside them not.
TEST_P(RedundantRows, AreTheirOwnInEveryLane) {
  InputsOfLanes inputs;
  for (int lane = 0; lane < Pack::lanes; ++lane)
    inputs.push_back(lane % 3 == 0 ? sample.inputs : net(GetParam(), 0.004 * lane).inputs);
  expect_bits_of_lanes(program, inputs, every_lane);
}

TEST_P(RedundantRows, AreAsManyAsTheRankIsShort) {
  const int links = sample.scene.groups[0].count, nodes = sample.scene.nodes();
  EXPECT_EQ(static_cast<int>(redundant_rows(sample.scene, program.plan, sample.inputs.data(), 0.0).size()),
            links - (2 * nodes - 3));
}

TEST(RedundantRowsOfASquare, AreNamedWithWhatTheyFollowFrom) {
  Sample s = net(1);
  const Plan plan = make_plan(s.scene, {.partition = Partition::direct});
  const auto rows = redundant_rows(s.scene, plan, s.inputs.data(), 0.0);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].others.size(), 5u);
  EXPECT_LT(rows[0].contradiction, 1e-15);
  const std::string text = describe(s.scene, rows, s.inputs.data());
  EXPECT_NE(text.find("links " + std::to_string(rows[0].row) + " (particles "), std::string::npos) << text;
  EXPECT_EQ(text.find("contradicts"), std::string::npos) << text;

  s.inputs[s.scene.layout.of(Quantity::rest) + rows[0].row] += 0.01;
  const auto against = redundant_rows(s.scene, plan, s.inputs.data(), 0.0);
  ASSERT_EQ(against.size(), 1u);
  EXPECT_GT(against[0].contradiction, 0.005);
  EXPECT_NE(describe(s.scene, against, s.inputs.data()).find("contradicts them by"), std::string::npos);
}

// Neither soft links, nor a bulge, nor a particle that is a hundred thousand times lighter.
TEST(RedundantRowsOfASquare, AreNoneWhereEveryLinkSaysSomething) {
  const auto found = [](const Sample& s) {
    return redundant_rows(s.scene, make_plan(s.scene, {.partition = Partition::direct}), s.inputs.data(), 0.0).size();
  };
  Sample soft = net(2), light = net(1, 0.01);
  const std::size_t compliance = soft.scene.layout.of(Quantity::compliance);
  std::fill_n(soft.inputs.begin() + compliance, soft.scene.constraints, 1e-7);
  light.inputs[light.scene.layout.of(Quantity::mass) + 3] *= 1e-5;
  EXPECT_EQ(found(soft), 0u);
  EXPECT_EQ(found(light), 0u);
  EXPECT_EQ(found(net(1, 0.01)), 0u);
}

}  // namespace
}  // namespace sheetbend::testing
