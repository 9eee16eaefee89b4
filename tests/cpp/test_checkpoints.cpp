// The schedule of checkpoints by itself, and gradients under budgets against those of the whole tape.
#include <atomic>
#include <map>
#include <thread>

#include "tests/cpp/support/programs.h"

namespace sheetbend::testing {
namespace {

// Follows a schedule with a set of kept states as a tape would, and counts what it advances.
long follow(int steps, int states, int window) {
  Schedule schedule(steps, states, window);
  std::vector<char> kept(steps + 1, 0);
  kept[0] = 1;
  const auto can_restart = [&](int step) {
    for (int k = std::max(0, step - window + 1); k <= step; ++k)
      if (!kept[k]) return false;
    return true;
  };
  long advanced = 0;
  int last = steps;
  while (const auto action = schedule.next()) {
    if (const auto* a = std::get_if<Advance>(&*action)) {
      EXPECT_TRUE(can_restart(a->from)) << "advance from " << a->from;
      EXPECT_LT(a->from, a->to);
      std::fill(kept.begin() + a->from + 1, kept.end(), 0);
      std::fill(kept.begin() + a->keep, kept.begin() + a->to + 1, 1);
      advanced += a->to - a->from;
    } else {
      EXPECT_EQ(std::get<Reverse>(*action).step, --last);
      EXPECT_TRUE(can_restart(last)) << "reverse of " << last;
    }
    EXPECT_LE(std::count(kept.begin(), kept.end(), 1), states);
  }
  EXPECT_EQ(last, 0);
  return advanced;
}

// Griewank & Walther (2000), theorem 3.1: the fewest advances for l steps and c states are r l - beta(c + 1, r - 1), with
// beta(c, r) = (c + r)! / (c! r!) and r the least number for which beta(c, r) >= l.
long fewest(long l, long c) {
  const long many = 1L << 40;
  long r = 1;
  while (binomial(c + r, c, many) < l) ++r;
  return r * l - binomial(c + r, r - 1, many);
}

TEST(Schedule, OfOneStateIsRevolve) {
  // Table 1 of the paper's kind: 10 steps, 3 states; then by the formula.
  EXPECT_EQ(fewest(10, 3), 15);
  for (const int states : {2, 3, 4, 6, 11, 50})
    for (const int steps : {2, 3, 7, 10, 11, 56, 57, 200, 1001})
      EXPECT_EQ(follow(steps, states, 1), fewest(steps, states - 1)) << steps << " steps, " << states << " states";
}

TEST(Schedule, ReachesBinomialNumbers) {
  for (int free = 0; free < 8; ++free)
    for (int times = 1; times < 8; ++times)
      EXPECT_EQ(reach(free, times, 1, 1 << 20), binomial(free + times, free, 1 << 20));
  for (int window = 1; window <= 4; ++window)
    for (int free = window; free < 20; ++free)
      for (int times = 2; times < 8; ++times)
        EXPECT_EQ(reach(free, times, window, 1 << 20),
                  reach(free, times - 1, window, 1 << 20) + reach(free - window, times, window, 1 << 20));
}

TEST(Schedule, KeepsEveryStateWhereTheyFit) {
  for (const int window : {1, 2, 4}) {
    EXPECT_EQ(follow(100, 100, window), 99);
    EXPECT_EQ(recomputed_steps(100, 100, window), 0);
  }
}

// The fewest advances that cutting a stretch in two, again and again, can have.
class Best {
 public:
  explicit Best(int window) : window_(window) {}
  long advances(int length, int free) {
    if (length <= free + 1) return length - 1;
    if (free < window_) return 1L << 40;
    long& best = known_[{length, free}];
    if (best > 0) return best;
    best = 1L << 41;
    for (int cut = 1; cut < length; ++cut)
      best = std::min(best, cut + advances(length - cut, free - window_) + advances(cut, free));
    return best;
  }

 private:
  int window_;
  std::map<std::pair<int, int>, long> known_;
};

TEST(Schedule, WithSeveralStatesPerRestartIsNearTheBest) {
  for (const auto& [window, allowed] : {std::pair{2, 1.03}, std::pair{4, 1.09}}) {
    Best best(window);
    for (int states = 1 + window; states < 30; ++states)
      for (int steps = 1; steps < 90; ++steps) {
        if (states < Schedule::least(steps, window)) continue;
        const long found = follow(steps, states, window), least = best.advances(steps, states - 1);
        EXPECT_GE(found, least);
        EXPECT_LE(found, allowed * least) << steps << " steps, " << states << " states, window " << window;
      }
  }
}

TEST(Schedule, RefusesTooFewStates) {
  EXPECT_EQ(Schedule::least(100, 4), 5);
  EXPECT_EQ(Schedule::least(2, 4), 2);
  EXPECT_EQ(Schedule::least(0, 4), 1);
  EXPECT_THROW(Schedule(100, 4, 4), std::invalid_argument);
}

struct Checkpoints : ::testing::TestWithParam<Solver> {
  Program program(const Scene& scene) const { return {scene, make_plan(scene, GetParam().options(2)), 24, 0.004}; }
};
INSTANTIATE_TEST_SUITE_P(, Checkpoints, all_solvers, solver_name);
INSTANTIATE_TEST_SUITE_P(Implicit, Checkpoints, ::testing::Values(implicit_bdf2), solver_name);

TEST_P(Checkpoints, GiveTheBitsOfTheWholeTape) {
  const Sample sample = random_scene(75, GetParam().shape());
  const Program p = program(sample.scene);
  const auto whole = gradient(p, sample.inputs);
  const int window = Tape<double>::window(p.plan);
  for (const int kept : {Schedule::least(p.steps, window), 7, 12, 23, 24}) {
    auto recorded = record(p, sample.inputs, kept);
    EXPECT_EQ(recorded.tape.states(), kept);
    EXPECT_EQ(recorded.tape.bytes(), (kept + Tape<double>::ends(p.plan)) * sizeof(double) * sample.scene.dofs());
    EXPECT_TRUE(same_bits(gradient(p, sample.inputs, recorded), whole)) << kept << " states";
    EXPECT_EQ(recorded.tape.recomputed(), recomputed_steps(p.steps, kept, window)) << kept << " states";
    // Once more from the same tape, whose states have been dropped.
    EXPECT_TRUE(same_bits(gradient(p, sample.inputs, recorded), whole)) << kept << " states, again";
  }
}

// Reverses of a tape that drops states take turns; those of a whole one only read it. The thread sanitizer looks at both.
TEST(CheckpointsInThreads, GiveTheBitsOfTheWholeTape) {
  for (const Partition partition : {Partition::direct, Partition::gauss_seidel}) {
    const Sample sample = random_scene(75);
    const Program p{sample.scene, make_plan(sample.scene, {.h = 4e-3, .partition = partition}), 24};
    const auto whole = gradient(p, sample.inputs);
    for (const int kept : {Schedule::least(p.steps, Tape<double>::window(p.plan)), 24}) {
      auto recorded = record(p, sample.inputs, kept);
      std::atomic<int> same = 0;
      std::vector<std::thread> threads;
      for (int t = 0; t < 4; ++t)
        threads.emplace_back([&] {
          for (int turn = 0; turn < 2; ++turn) same += same_bits(gradient(p, sample.inputs, recorded), whole);
        });
      for (std::thread& thread : threads) thread.join();
      EXPECT_EQ(same, 8) << kept << " states";
      EXPECT_TRUE(same_bits(gradient(p, sample.inputs, recorded), whole)) << kept << " states, afterwards";
    }
  }
}

TEST_P(Checkpoints, GiveTheBitsOfTheWholeTapeInLanes) {
  const Sample sample = random_scene(77, GetParam().shape());
  const Program p = program(sample.scene);
  Random random(76);
  std::vector<Pack> packed(sample.inputs.size());
  for (int lane = 0; lane < Pack::lanes; ++lane)
    for (std::size_t i = 0; i < packed.size(); ++i) packed[i].set(lane, sample.inputs[i] * random(0.998, 1.002));
  const auto numbers_of = [](const std::vector<Pack>& packs) {
    std::vector<double> out;
    for (const Pack& a : packs)
      for (int lane = 0; lane < Pack::lanes; ++lane) out.push_back(a[lane]);
    return out;
  };
  const auto whole = numbers_of(gradient(p, packed));
  for (const int kept : {5, 9, 15}) {
    auto recorded = record(p, packed, kept);
    EXPECT_TRUE(same_bits(numbers_of(gradient(p, packed, recorded)), whole)) << kept << " states";
  }
}

}  // namespace
}  // namespace sheetbend::testing
