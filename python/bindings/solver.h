// A scene with its plan, as the files of this module share it.
#pragma once

#include <algorithm>
#include <memory>

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

// Throws std::invalid_argument where there is none of that name.
inline Partition partition_of(const std::string& name) {
  if (name == "direct") return Partition::direct;
  if (name == "newton") return Partition::newton;
  if (name == "newton_cg") return Partition::newton_cg;
  if (name == "gauss_seidel") return Partition::gauss_seidel;
  throw std::invalid_argument("partition: got '" + name +
                              "'. Fix: use 'direct', 'newton', 'newton_cg' or 'gauss_seidel'");
}

using Steps = std::vector<int>;
using Release = py::gil_scoped_release;

void check(const Solver& s, const Array& inputs, std::size_t batch, const Steps& steps);

inline py::array_t<double> empty(std::vector<std::size_t> shape) { return py::array_t<double>(std::move(shape)); }

inline py::array_t<double> zeros(std::vector<std::size_t> shape) {
  auto out = empty(std::move(shape));
  std::fill_n(out.mutable_data(), out.size(), 0.0);
  return out;
}

void bind_gradient(py::module_& m, py::class_<Solver>& solver);

// Packs of eight scenes; lanes past the end repeat the last scene.
std::vector<Pack> to_lanes(const double* data, std::size_t batch, std::size_t first, std::size_t size);
void from_lanes(const std::vector<Pack>& lanes, double* data, std::size_t batch, std::size_t first);

// Calls f(first, inputs, interrupt) for every eight scenes of a batch, packs over threads and without the interpreter's lock.
template <class F>
void for_each_pack(const Solver& s, const double* inputs, std::size_t batch, F&& f) {
  Release release;
  SignalInterrupt interrupt;
  const int packs = static_cast<int>((batch + Pack::lanes - 1) / Pack::lanes);
  parallel_for(packs, s.plan.options.threads, 1, [&](int begin, int end) {
    for (int p = begin; p < end; ++p) {
      const std::size_t first = static_cast<std::size_t>(p) * Pack::lanes;
      f(first, to_lanes(inputs, batch, first, s.scene->layout.total()), &interrupt);
    }
  });
}

}  // namespace sheetbend::bindings
