// A scene with its plan, as the files of this module share it.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <utility>

#include "adjoint/tape/tape_plan.h"
#include "core/scalar/pack.h"
#include "core/solver/plan.h"
#include "core/threads/pool.h"
#include "python/bindings/core_module.h"
#include "python/bindings/interrupt.h"

namespace sheetbend::bindings {

struct Solver {
  std::shared_ptr<Scene> scene;
  Plan plan;
};

inline constexpr std::array<std::pair<const char*, Partition>, 5> partitions{
    {{"direct", Partition::direct},
     {"newton", Partition::newton},
     {"newton_cg", Partition::newton_cg},
     {"implicit", Partition::implicit},
     {"gauss_seidel", Partition::gauss_seidel}}};

inline const char* name_of(Partition partition) {
  return std::ranges::find(partitions, partition, &std::pair<const char*, Partition>::second)->first;
}

// Throws std::invalid_argument where there is none of that name.
inline Partition partition_of(const std::string& name) {
  for (const auto& [known, partition] : partitions)
    if (name == known) return partition;
  throw std::invalid_argument("partition: got '" + name +
                              "'. Fix: use 'direct', 'newton', 'newton_cg', 'implicit' or 'gauss_seidel'");
}

using Steps = std::vector<int>;
using Release = py::gil_scoped_release;

void check(const Solver& s, const Array& inputs, std::size_t batch, const Steps& steps);

inline py::array_t<double> empty(const std::vector<std::size_t>& shape) { return py::array_t<double>(shape); }

inline py::array_t<double> zeros(const std::vector<std::size_t>& shape) {
  auto out = empty(shape);
  std::fill_n(out.mutable_data(), out.size(), 0.0);
  return out;
}

void bind_gradient(py::module_& m, py::class_<Solver>& solver);
void bind_tangents(py::class_<Solver>& solver);

using Memory = std::optional<std::size_t>;

template <class T>
TapePlan plan_of(const Solver& s, const Steps& steps, std::size_t scenes, const Memory& memory) {
  return plan_tape<T>(*s.scene, s.plan, steps.back(), steps.size(), scenes, memory.value_or(no_budget));
}

// How many of the frames each scene of a batch has; from Python all of them where it is empty.
using Lengths = std::vector<int>;

// One for each scene. Throws std::invalid_argument where the lengths do not fit.
Lengths frames_of(std::size_t batch, const Steps& steps, const Lengths& lengths);

// Calls f(i, interrupt) for every i < count, over the solver's threads and without the interpreter's lock.
template <class F>
void over_threads(const Solver& s, std::size_t count, F&& f) {
  Release release;
  SignalInterrupt interrupt;
  parallel_for(static_cast<int>(count), s.plan.options.threads, 1, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) f(i, &interrupt);
  });
}

// Eight scenes of a batch that go through one rollout; lanes that are left over repeat one of them.
struct PackOfScenes {
  std::size_t scene[Pack::lanes];
  int count;
  int length[Pack::lanes];  // frames of each
  int frames;               // of the longest

  // A row of the first `size` of `stride` numbers for each scene.
  std::vector<Pack> to_lanes(const double* data, std::size_t size, std::size_t stride) const;
  void from_lanes(const std::vector<Pack>& lanes, double* data, std::size_t stride) const;
};

// Scenes of like length go together.
std::vector<PackOfScenes> packs_of(const Lengths& frames);

// Calls f(pack, inputs, steps, interrupt) for every eight scenes of a batch.
template <class F>
void for_each_pack(const Solver& s, const double* inputs, std::size_t batch, const Steps& steps, const Lengths& lengths,
                   F&& f) {
  const std::vector<PackOfScenes> packs = packs_of(frames_of(batch, steps, lengths));
  const std::size_t total = s.scene->layout.total();
  over_threads(s, packs.size(), [&](int p, Interrupt* interrupt) {
    const Steps own(steps.begin(), steps.begin() + packs[p].frames);
    f(packs[p], packs[p].to_lanes(inputs, total, total), own, interrupt);
  });
}

}  // namespace sheetbend::bindings
