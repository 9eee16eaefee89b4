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

constexpr int constraints = 1024, steps = 2;

template <class Work>
void count(const std::string& label, Work&& work) {
  CALLGRIND_ZERO_STATS;
  work();
  CALLGRIND_DUMP_STATS_AT(label.c_str());
}

// Two numbers of sweeps each, so that what does not depend on it cancels. The label ends with the projections.
template <class K>
void count_kind(bool damped) {
  const OneColor color(K{}, constraints, steps, damped);
  for (const int sweeps : {2, 6}) {
    const Plan plan = color.plan(sweeps);
    const std::string name = std::string(K::name) + (damped ? " damped" : "");
    const std::string projections = std::to_string(constraints * steps * sweeps);
    count(name + " forward " + projections, [&] { color.forward(plan); });
    count(name + " gradient " + projections, [&] { color.gradient(plan); });
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
  sheetbend::for_each_kind([]<class K>(K) {
    for (const bool damped : {false, true}) sheetbend::bench::count_kind<K>(damped);
  });
}
