// Scenes in the lanes of a pack against the same scenes alone, and one scene however its states are kept.
#pragma once

#include "core/scalar/pack.h"
#include "tests/cpp/support/programs.h"

namespace sheetbend::testing {

using InputsOfLanes = std::vector<std::vector<double>>;

inline std::vector<double> lane_of(const std::vector<Pack>& packs, int lane) {
  std::vector<double> own;
  for (const Pack& a : packs) own.push_back(a[lane]);
  return own;
}

// Eight scenes with inputs a few percent apart.
inline InputsOfLanes scattered(const std::vector<double>& inputs, unsigned seed) {
  Random random(seed);
  InputsOfLanes all(Pack::lanes, inputs);
  for (auto& own : all)
    for (double& a : own) a *= random(0.98, 1.02);
  return all;
}

inline std::vector<Pack> packed(const InputsOfLanes& inputs) {
  std::vector<Pack> packs(inputs[0].size());
  for (std::size_t i = 0; i < packs.size(); ++i) packs[i] = per_lane([&](int lane) { return inputs[lane][i]; });
  return packs;
}

// States and gradients of eight scenes in lanes have the bits of each scene alone.
inline void expect_bits_of_lanes(const Program& p, const InputsOfLanes& inputs, const std::vector<int>& lanes,
                                 int kept = every_state) {
  const std::vector<Pack> in = packed(inputs);
  auto recorded = record(p, in, kept);
  EXPECT_TRUE(same_bits(recorded.states, states(p, in))) << "with and without a tape";
  const auto reverse = gradient(p, in, recorded);
  for (const int lane : lanes) {
    EXPECT_TRUE(same_bits(lane_of(recorded.states, lane), states(p, inputs[lane]))) << "states, lane " << lane;
    EXPECT_TRUE(same_bits(lane_of(reverse, lane), gradient(p, inputs[lane]))) << "gradient, lane " << lane;
  }
}

inline const std::vector<int> every_lane{0, 1, 2, 3, 4, 5, 6, 7};
static_assert(Pack::lanes == 8);

// States and gradient have the same bits with and without a tape, with few states kept, and in any number of threads.
inline void expect_bits_of_any_tape(Program p, const std::vector<double>& inputs) {
  const auto plain = states(p, inputs);
  auto recorded = record(p, inputs);
  EXPECT_TRUE(same_bits(recorded.states, plain));
  const auto expected = gradient(p, inputs, recorded);
  const int least = Schedule::least(p.steps, Tape<double>::window(p.plan));
  for (const int kept : {least, least + 2}) {
    auto few = record(p, inputs, kept);
    EXPECT_TRUE(same_bits(gradient(p, inputs, few), expected)) << kept << " states";
  }
  p.plan.options.grain = 1;  // so that as few items as these are shared out
  for (const int threads : {2, 3, 8}) {
    p.plan.options.threads = threads;
    EXPECT_TRUE(same_bits(states(p, inputs), plain)) << threads << " threads";
    EXPECT_TRUE(same_bits(gradient(p, inputs), expected)) << threads << " threads";
  }
}

}  // namespace sheetbend::testing
