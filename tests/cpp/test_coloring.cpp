// The plan: colors that can go in parallel, chains that become narrow bands, everything found the same way
// every time.
#include <numeric>
#include <set>

#include "core/solver/ordering.h"
#include "tests/cpp/support/random_scene.h"

namespace sheetbend::testing {
namespace {

Scene rope(int particles, bool bend, const std::vector<int>& label) {
  SceneSpec spec;
  spec.particles = particles;
  std::vector<int> links, joints;
  for (int i = 0; i + 1 < particles; ++i) links.insert(links.end(), {label[i], label[i + 1]});
  for (int i = 0; i + 2 < particles; ++i) joints.insert(joints.end(), {label[i], label[i + 1], label[i + 2]});
  spec.groups = {{"links", "distance", false, links}};
  if (bend) spec.groups.push_back({"joints", "bend", false, joints});
  return build_scene(spec);
}

std::vector<int> in_order(int n) {
  std::vector<int> label(n);
  std::iota(label.begin(), label.end(), 0);
  return label;
}

std::vector<int> shuffled(int n, unsigned seed) {
  std::vector<int> label = in_order(n);
  Random random(seed);
  for (int i = n - 1; i > 0; --i) std::swap(label[i], label[static_cast<int>(random(0.0, i + 1.0))]);
  return label;
}

struct Coloring : ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(, Coloring, ::testing::Bool(), [](const auto& info) { return info.param ? "Net" : "Ropes"; });

TEST_P(Coloring, HoldsEveryConstraintOnce) {
  const Scene scene = random_scene(80, {.net = GetParam(), .unilateral = true}).scene;
  std::multiset<std::pair<int, int>> seen;
  for (const Color& color : color_constraints(scene))
    for (const int item : color.items) seen.emplace(color.group, item);
  EXPECT_EQ(static_cast<int>(seen.size()), scene.constraints);
  EXPECT_EQ(std::set(seen.begin(), seen.end()).size(), seen.size());
}

TEST_P(Coloring, SharesNoMovableParticle) {
  const Scene scene = random_scene(81, {.net = GetParam(), .unilateral = true}).scene;
  for (const Color& color : color_constraints(scene)) {
    std::set<int> used;
    for (const int item : color.items)
      for (const int node : scene.groups[color.group].nodes(item))
        EXPECT_TRUE(scene.role[node] != Role::free || used.insert(node).second) << "particle " << node;
  }
}

TEST_P(Coloring, IsDeterministic) {
  const auto a = color_constraints(random_scene(82, {.net = GetParam(), .unilateral = true}).scene),
             b = color_constraints(random_scene(82, {.net = GetParam(), .unilateral = true}).scene);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t c = 0; c < a.size(); ++c) {
    EXPECT_EQ(a[c].group, b[c].group);
    EXPECT_EQ(a[c].items, b[c].items);
  }
}

TEST_P(Coloring, BlocksHoldEveryConstraintOnceAndShareNoMovableParticle) {
  const Scene scene = random_scene(83, {.net = GetParam()}).scene;
  std::set<std::pair<int, int>> seen;
  std::vector<int> home(scene.nodes(), -1);
  const Plan plan = make_plan(scene, {.partition = Partition::direct}),
             again = make_plan(scene, {.partition = Partition::direct});
  for (int b = 0; b < static_cast<int>(plan.blocks.size()); ++b)
    for (std::size_t k = 0; k < plan.blocks[b].members.size(); ++k) {
      const Member& m = plan.blocks[b].members[k];
      EXPECT_TRUE(seen.emplace(m.group, m.item).second);
      EXPECT_EQ(m.item, again.blocks[b].members[k].item);
      for (const int node : scene.groups[m.group].nodes(m.item)) {
        if (scene.role[node] != Role::free) continue;
        EXPECT_TRUE(home[node] == -1 || home[node] == b) << "particle " << node;
        home[node] = b;
      }
    }
  EXPECT_EQ(static_cast<int>(seen.size()), scene.constraints);
}

TEST(ColoringOf, ChainTakesTwoColorsAndSpokesOfADrivenHubOne) {
  EXPECT_EQ(color_constraints(rope(30, false, in_order(30))).size(), 2u);
  SceneSpec spec;
  spec.particles = 9;
  spec.driven = {0};
  spec.boundary.times = {0.0};
  std::vector<int> spokes;
  for (int i = 1; i < 9; ++i) spokes.insert(spokes.end(), {0, i});
  spec.groups = {{"spokes", "distance", false, spokes}};
  EXPECT_EQ(color_constraints(build_scene(spec)).size(), 1u);
}

// Links alone couple neighbors. With joints (1 + 3 rows a particle) a joint couples to the one two particles
// on: 2 * 4 + 2 rows away.
TEST(DirectBlock, ChainIsANarrowBand) {
  for (const int n : {10, 40}) {
    EXPECT_EQ(make_plan(rope(n, false, in_order(n)), {.partition = Partition::direct})
                  .blocks.at(0)
                  .structure.half_bandwidth(),
              1);
    EXPECT_EQ(
        make_plan(rope(n, true, in_order(n)), {.partition = Partition::direct}).blocks.at(0).structure.half_bandwidth(),
        10);
  }
}

TEST(DirectBlock, ChainIsANarrowBandHoweverItsParticlesAreNumbered) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    EXPECT_EQ(make_plan(rope(40, false, shuffled(40, seed)), {.partition = Partition::direct})
                  .blocks.at(0)
                  .structure.half_bandwidth(),
              1);
    EXPECT_EQ(make_plan(rope(40, true, shuffled(40, seed)), {.partition = Partition::direct})
                  .blocks.at(0)
                  .structure.half_bandwidth(),
              10)
        << seed;
  }
}

TEST(Plan, RefusesWhatCannotBeStepped) {
  const Scene scene = rope(3, false, in_order(3));
  for (const SolverOptions& bad : {SolverOptions{.h = 0.0}, SolverOptions{.h = -1.0}, SolverOptions{.h = std::nan("")},
                                   SolverOptions{.iterations = 0}, SolverOptions{.threads = 0}}) {
    try {
      make_plan(scene, bad);
      ADD_FAILURE() << "accepted";
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find("Fix:"), std::string::npos) << e.what();
    }
  }
}

}  // namespace
}  // namespace sheetbend::testing
