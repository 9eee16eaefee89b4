// Tangents from Python: JVPs and, as tangents of VJPs, second derivatives, of batches one rollout per thread at a time; the complex step that checks
// them. Shapes as in core_rollout.cpp.
#include <algorithm>
#include <cstring>
#include <numeric>
#include <ranges>
#include <span>

#include "adjoint/rollout/rollout.h"
#include "core/scalar/complex.h"
#include "core/scalar/dual.h"
#include "python/bindings/solver.h"

namespace sheetbend::bindings {
namespace {

constexpr std::size_t width = 8;  // directions that share a rollout
using Eight = Dual<double, width>;
using Directions = std::span<const std::size_t>;  // rows of inputs_dot (.., total)

// States of one scene with their tangents along up to eight directions.
std::vector<Eight> states_along(const Solver& s, const double* inputs, const double* inputs_dot, Directions directions,
                                const Steps& steps, double t0, Interrupt* interrupt) {
  const std::size_t total = s.scene->layout.total();
  std::vector<Eight> in(inputs, inputs + total), states(steps.size() * s.scene->dofs());
  for (std::size_t k = 0; k < directions.size(); ++k)
    for (std::size_t i = 0; i < total; ++i) in[i].d[k] = inputs_dot[directions[k] * total + i];
  rollout_states(*s.scene, s.plan, in.data(), t0, steps, states.data(), interrupt);
  return states;
}

// States (F, dofs) of one scene and their tangents (columns, F, dofs).
py::tuple jvp(const Solver& s, const Array& inputs, const Array& inputs_dot, const Steps& steps, double t0) {
  check(s, inputs, 1, steps);
  const std::size_t total = s.scene->layout.total(), dofs = s.scene->dofs(), size = steps.size() * dofs;
  std::vector<std::size_t> columns(static_cast<std::size_t>(inputs_dot.size()) / total);
  std::iota(columns.begin(), columns.end(), 0);
  expect_size(inputs_dot, columns.size() * total, "inputs_dot");
  auto values = empty({steps.size(), dofs}), tangents = empty({columns.size(), steps.size(), dofs});
  double *x = values.mutable_data(), *x_dot = tangents.mutable_data();
  {
    Release release;
    SignalInterrupt interrupt;
    for (std::size_t first = 0; first < columns.size(); first += width) {
      const auto own = Directions(columns).subspan(first, std::min(width, columns.size() - first));
      const auto states = states_along(s, inputs.data(), inputs_dot.data(), own, steps, t0, &interrupt);
      for (std::size_t i = 0; i < size; ++i) {
        x[i] = states[i].v;
        for (std::size_t k = 0; k < own.size(); ++k) x_dot[own[k] * size + i] = states[i].d[k];
      }
    }
  }
  return py::make_tuple(values, tangents);
}

// Directions of a batch, one per row of its inputs, by rollout: up to eight of scenes that are equal to the bit.
std::vector<std::vector<std::size_t>> shared_rollouts(const double* inputs, std::size_t batch, std::size_t total) {
  const auto compare = [&](std::size_t a, std::size_t b) {
    return std::memcmp(inputs + a * total, inputs + b * total, total * sizeof(double));
  };
  std::vector<std::size_t> order(batch);
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return compare(a, b) < 0; });
  std::vector<std::vector<std::size_t>> rollouts;
  for (const std::size_t row : order) {
    if (rollouts.empty() || rollouts.back().size() == width || compare(rollouts.back()[0], row) != 0)
      rollouts.emplace_back();
    rollouts.back().push_back(row);
  }
  return rollouts;
}

// Tangents (B, F, dofs) of a batch, each along a direction of its own; those of frames after a scene's last are zero.
py::array_t<double> jvp_batch(const Solver& s, const Array& inputs, const Array& inputs_dot, const Steps& steps,
                              double t0, const Lengths& lengths) {
  const std::size_t total = s.scene->layout.total(), dofs = s.scene->dofs();
  const std::size_t count = static_cast<std::size_t>(inputs.size()) / total;
  check(s, inputs, count, steps);
  expect_size(inputs_dot, count * total, "inputs_dot");
  const Lengths frames = frames_of(count, steps, lengths);
  const auto rollouts = shared_rollouts(inputs.data(), count, total);
  auto out = zeros({count, steps.size(), dofs});
  double* x_dot = out.mutable_data();
  over_threads(s, rollouts.size(), [&](int rollout, Interrupt* interrupt) {
    const Directions own = rollouts[rollout];
    const int longest = std::ranges::max(own | std::views::transform([&](std::size_t row) { return frames[row]; }));
    const auto states = states_along(s, inputs.data() + own[0] * total, inputs_dot.data(), own,
                                     {steps.begin(), steps.begin() + longest}, t0, interrupt);
    for (std::size_t k = 0; k < own.size(); ++k)
      for (std::size_t i = 0; i < frames[own[k]] * dofs; ++i) x_dot[own[k] * steps.size() * dofs + i] = states[i].d[k];
  });
  return out;
}

// Forward over reverse: derivatives (B, total) of the gradients of a batch along (inputs_dot, x_bar_dot).
py::array_t<double> vjp_dot_batch(const Solver& s, const Array& inputs, const Array& inputs_dot, const Steps& steps,
                                  const Array& x_bar, const Array& x_bar_dot, double t0, const Memory& memory,
                                  const Lengths& lengths) {
  using One = Dual<double, 1>;
  const std::size_t total = s.scene->layout.total(), dofs = s.scene->dofs(), size = steps.size() * dofs;
  const std::size_t count = static_cast<std::size_t>(inputs.size()) / total;
  check(s, inputs, count, steps);
  expect_size(inputs_dot, count * total, "inputs_dot");
  expect_size(x_bar, count * size, "x_bar");
  expect_size(x_bar_dot, count * size, "x_bar_dot");
  const Lengths frames = frames_of(count, steps, lengths);
  const TapePlan plan = plan_of<One>(s, steps, count, memory);
  auto out = empty({count, total});
  double* derivatives = out.mutable_data();
  const auto duals = [](const Array& values, const Array& tangents, std::size_t first, std::size_t size) {
    std::vector<One> all(values.data() + first, values.data() + first + size);
    for (std::size_t i = 0; i < size; ++i) all[i].d[0] = tangents.data()[first + i];
    return all;
  };
  over_threads(s, count, [&](std::size_t b, Interrupt* interrupt) {
    const Steps own(steps.begin(), steps.begin() + frames[b]);
    const std::vector<One> in = duals(inputs, inputs_dot, b * total, total);
    const std::vector<One> seed = duals(x_bar, x_bar_dot, b * size, own.size() * dofs);
    std::vector<One> x(seed.size()), bar(total);
    auto tape = record_rollout(*s.scene, s.plan, in.data(), t0, own, x.data(), plan.states, interrupt);
    reverse_rollout(*s.scene, s.plan, in.data(), t0, tape, own, seed.data(), bar.data(), interrupt);
    for (std::size_t i = 0; i < total; ++i) derivatives[b * total + i] = bar[i].d[0];
  });
  return out;
}

// Derivative of the states along one direction by complex step: an independent path for checks.
py::array_t<double> complex_step(const Solver& s, const Array& inputs, const Array& direction, const Steps& steps,
                                 double t0) {
  check(s, inputs, 1, steps);
  expect_size(direction, s.scene->layout.total(), "direction");
  constexpr double step = 1e-40;
  const std::size_t dofs = s.scene->dofs();
  auto out = empty({steps.size(), dofs});
  double* x_dot = out.mutable_data();
  Release release;
  SignalInterrupt interrupt;
  std::vector<Complex> in(inputs.data(), inputs.data() + inputs.size()), x(steps.size() * dofs);
  for (std::size_t i = 0; i < in.size(); ++i) in[i].im = step * direction.data()[i];
  rollout_states(*s.scene, s.plan, in.data(), t0, steps, x.data(), &interrupt);
  for (std::size_t i = 0; i < x.size(); ++i) x_dot[i] = x[i].im / step;
  return out;
}

}  // namespace

void bind_tangents(py::class_<Solver>& solver) {
  solver.def("jvp", &jvp, py::arg("inputs"), py::arg("inputs_dot"), py::arg("steps"), py::arg("t0"))
      .def("jvp_batch", &jvp_batch, py::arg("inputs"), py::arg("inputs_dot"), py::arg("steps"), py::arg("t0"),
           py::arg("lengths") = Lengths())
      .def("vjp_dot_batch", &vjp_dot_batch, py::arg("inputs"), py::arg("inputs_dot"), py::arg("steps"),
           py::arg("x_bar"), py::arg("x_bar_dot"), py::arg("t0"), py::arg("memory") = py::none(),
           py::arg("lengths") = Lengths())
      .def("complex_step", &complex_step, py::arg("inputs"), py::arg("direction"), py::arg("steps"), py::arg("t0"));
}

}  // namespace sheetbend::bindings
