// Runs sweeps of every kind of constraint under callgrind, which counts their instructions; count.py reads the counts.
// Prints the compiler, and whether it was compiled with callgrind's header: without, nothing is counted.
#if __has_include(<valgrind/callgrind.h>)
#include <valgrind/callgrind.h>
#define SHEETBEND_COUNTS true
#else
#define SHEETBEND_COUNTS false
#define CALLGRIND_ZERO_STATS
#define CALLGRIND_DUMP_STATS_AT(label) static_cast<void>(label)
#endif

#include <cstdio>
#include <string>

#include "experiments/bench/one_color.h"

namespace sheetbend::bench {
namespace {

constexpr int constraints = 512;

template <class Work>
void count(const std::string& label, Work&& work) {
  CALLGRIND_ZERO_STATS;
  work();
  CALLGRIND_DUMP_STATS_AT(label.c_str());
}

// Two numbers of substeps times two of sweeps, so that what does not grow with both cancels. The label ends with the three sizes.
template <class K>
void count_kind(bool damped) {
  const std::string name = std::string(K::name) + (damped ? " damped" : "");
  for (const int steps : {1, 3}) {
    const OneColor color(K{}, constraints, steps, damped);
    for (const int sweeps : {1, 4}) {
      const Plan plan = color.plan(sweeps);
      const std::string sizes =
          std::to_string(constraints) + " " + std::to_string(steps) + " " + std::to_string(sweeps);
      count(name + " forward " + sizes, [&] { color.forward(plan); });
      count(name + " gradient " + sizes, [&] { color.gradient(plan); });
    }
  }
}

}  // namespace
}  // namespace sheetbend::bench

int main() {
#if defined(__clang__)
  std::printf("clang %d %d\n", __clang_major__, SHEETBEND_COUNTS);
#else
  std::printf("gcc %d %d\n", __GNUC__, SHEETBEND_COUNTS);
#endif
  const sheetbend::bench::OneColor first(sheetbend::Distance{}, 8, 1, false);
  first.gradient(first.plan(1));  // the dynamic linker's work is not counted
  sheetbend::for_each_kind([]<class K>(K) {
    for (const bool damped : {false, true}) sheetbend::bench::count_kind<K>(damped);
  });
}
