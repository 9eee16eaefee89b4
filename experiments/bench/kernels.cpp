// Time per projection of every kind of constraint, forward and with the gradient: a rollout of one color with so many sweeps per substep
// that little else counts. One run measures one instruction set: SHEETBEND_ISA=x86-64-v3 kernels
#include <benchmark/benchmark.h>

#include <string>

#include "core/packs/packed_colors.h"
#include "experiments/bench/one_color.h"

namespace sheetbend::bench {
namespace {

constexpr int constraints = 1024, steps = 16, sweeps = 8;

template <class K, bool with_gradient>
void run(benchmark::State& state, bool damped) {
  const OneColor color(K{}, constraints, steps, damped);
  const Plan plan = color.plan(sweeps);
  for (auto _ : state) {
    if constexpr (with_gradient)
      benchmark::DoNotOptimize(color.gradient(plan));
    else
      benchmark::DoNotOptimize(color.forward(plan));
  }
  state.counters["per_projection"] =
      benchmark::Counter(double(constraints) * steps * sweeps,
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

}  // namespace
}  // namespace sheetbend::bench

int main(int count, char** arguments) {
  using namespace sheetbend;
  benchmark::Initialize(&count, arguments);
  if (benchmark::ReportUnrecognizedArguments(count, arguments)) return 2;
  benchmark::AddCustomContext("instruction_set", pack_kernels().name);
  for_each_kind([]<class K>(K) {
    for (const bool damped : {false, true}) {
      const std::string name = std::string(K::name) + (damped ? "/damped" : "");
      benchmark::RegisterBenchmark((name + "/forward").c_str(), bench::run<K, false>, damped);
      benchmark::RegisterBenchmark((name + "/gradient").c_str(), bench::run<K, true>, damped);
    }
  });
  benchmark::RunSpecifiedBenchmarks();
}
