// A scene with its plan, as the files of this module share it.
#pragma once

#include <algorithm>
#include <memory>

#include "core/scalar/pack.h"
#include "core/solver/plan.h"
#include "python/bindings/core_module.h"

namespace sheetbend::bindings {

struct Solver {
  std::shared_ptr<Scene> scene;
  Plan plan;
};

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

}  // namespace sheetbend::bindings
