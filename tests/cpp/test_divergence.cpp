// States that nothing put into a rollout explains, made by hand: where each of the three limits lies.
#include <gtest/gtest.h>

#include "core/scalar/dual.h"
#include "core/solver/divergence.h"
#include "core/solver/scenes.h"

namespace sheetbend::testing {
namespace {

// Eleven particles of 10 g on ten springs of 0.1 m along x, the first one pinned.
struct Chain {
  static constexpr int count = 11;
  Scene scene;
  std::vector<double> inputs, x, v, mass = std::vector<double>(count, 0.01);
  SolverOptions options{.h = 1e-3};

  explicit Chain(double compliance) {
    SceneSpec spec;
    spec.particles = count;
    spec.pinned = {0};
    GroupSpec links{"links", "distance", false, {}};
    for (int k = 0; k + 1 < count; ++k) links.stencil.insert(links.stencil.end(), {k, k + 1});
    spec.groups = {links};
    scene = build_scene(spec);
    inputs.resize(scene.layout.total());
    const Inputs<double> in{scene.layout, inputs.data()};
    std::fill_n(in.of(Quantity::compliance), count - 1, compliance);
    std::fill_n(in.of(Quantity::rest), count - 1, 0.1);
    std::fill_n(in.of(Quantity::mass), count, 0.01);
    in.of(Quantity::gravity)[2] = -9.81;
    for (int k = 0; k < count; ++k) in.of(Quantity::position)[3 * k] = 0.1 * k;
    x.assign(in.of(Quantity::position), in.of(Quantity::position) + 3 * count);
    v.assign(3 * count, 0.0);
  }

  Moved state() const { return {inputs.data(), x.data(), v.data(), mass.data()}; }

  // Whether the state is suspected, and refused.
  std::optional<Finding> look() const {
    StateCheck check(scene, options, 0.0);
    const Inputs<const double> in{scene.layout, inputs.data()};
    const auto found = check.find(state(), in, 1.0);
    EXPECT_TRUE(check.suspects(state()) || !found) << "what is wrong must be suspected";
    if (!found) {
      EXPECT_FALSE(check.suspects(state())) << "what was in order is not suspected again";
    }
    return found;
  }
};

TEST(Divergence, TheStartIsInOrder) {
  for (const double compliance : {0.0, 1e-6, 1.0}) EXPECT_FALSE(Chain(compliance).look());
}

TEST(Divergence, SpeedsThatNothingExplains) {
  Chain chain(1e-4);
  for (int k = 1; k < Chain::count; ++k) chain.v[3 * k + 1] = 100.0 + k;  // sqrt(9.81 m) times 100 is 313 m/s
  EXPECT_FALSE(chain.look());
  for (double& v : chain.v) v *= 1000.0;
  const auto found = chain.look();
  ASSERT_TRUE(found);
  EXPECT_EQ(found->node, 10);
  EXPECT_NE(found->seen.find("1.1e+05 m/s"), std::string::npos) << found->seen;
}

TEST(Divergence, StretchedSpringsAreJudgedByTheirEnergy) {
  // 1 kg of gravity per meter against springs of 1/compliance: soft ones may be that long.
  for (const double compliance : {0.0, 1e-6, 1e-5}) {
    Chain chain(compliance);
    chain.x[3 * 10 + 2] = -5.0;
    const auto found = chain.look();
    ASSERT_TRUE(found) << compliance;
    EXPECT_EQ(found->node, 10);
    EXPECT_NE(found->seen.find("'links' is stretched to 50"), std::string::npos) << found->seen;
  }
  Chain soft(0.1);
  soft.x[3 * 10 + 2] = -5.0;
  EXPECT_FALSE(soft.look());
}

TEST(Divergence, AChainShrunkToAPoint) {
  for (const double compliance : {0.0, 1e-5}) {
    Chain chain(compliance);
    for (int k = 1; k < Chain::count; ++k) chain.x[3 * k] = 1e-6 * k;
    const auto found = chain.look();
    ASSERT_TRUE(found) << compliance;
    EXPECT_NE(found->seen.find("at one point"), std::string::npos) << found->seen;
  }
  Chain soft(0.1);
  for (int k = 1; k < Chain::count; ++k) soft.x[3 * k] = 1e-6 * k;
  StateCheck check(soft.scene, soft.options, 0.0);
  EXPECT_FALSE(check.find(soft.state(), {soft.scene.layout, soft.inputs.data()}, 1.0));
  Chain folded(1e-5);  // onto itself: every link keeps its length
  for (int k = 1; k < Chain::count; ++k) folded.x[3 * k] = 0.1 * (k % 2);
  EXPECT_FALSE(folded.look());
}

TEST(Divergence, EnergyAtTheStartExplainsWhatItDrives) {
  Chain chain(1e-6);
  const Inputs<double> in{chain.scene.layout, chain.inputs.data()};
  chain.x[3 * 10 + 2] = -5.0;
  ASSERT_TRUE(chain.look());
  in.of(Quantity::position)[3 * 10 + 2] = -0.4;  // 0.09 J at the start were 45 kJ
  EXPECT_FALSE(chain.look());
}

TEST(Divergence, LanesArePlainNumbers) {
  Pack pack(1.0);
  pack.set(3, 2.0);
  EXPECT_EQ(number_of(pack, 3), 2.0);
  EXPECT_EQ(number_of(pack, 4), 1.0);
  EXPECT_EQ(number_of(Dual<double, 8>(3.0), 0), 3.0);
  EXPECT_EQ(scenes_of<Pack>, Pack::lanes);
}

}  // namespace
}  // namespace sheetbend::testing
