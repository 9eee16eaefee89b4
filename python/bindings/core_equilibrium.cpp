// Static equilibrium from Python: the solution and its derivative.
#include "core/equilibrium/equilibrium.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <numeric>
#include <optional>

#include "adjoint/equilibrium/equilibrium_vjp.h"
#include "core/threads/pool.h"
#include "python/bindings/core_module.h"
#include "python/bindings/interrupt.h"

namespace sheetbend::bindings {
namespace {

struct Solution {
  std::shared_ptr<Scene> scene;
  std::vector<double> inputs;
  Equilibrium at;
};

// For inputs (B, total), spread over threads; the ordering of the Newton matrix is found once per thread.
std::vector<Solution> solve_batch(const std::shared_ptr<Scene>& scene, const Array& inputs,
                                  const std::optional<Array>& start, bool stable, int threads) {
  const std::size_t total = scene->layout.total(), count = static_cast<std::size_t>(inputs.size()) / total;
  expect_size(inputs, count * total, "inputs");
  if (start) expect_size(*start, scene->dofs(), "start");
  std::vector<Solution> all;
  for (std::size_t b = 0; b < count; ++b)
    all.push_back({scene, {inputs.data() + b * total, inputs.data() + (b + 1) * total}, {}});
  const double* from = start ? start->data() : nullptr;
  EquilibriumOptions options;
  options.stable = stable;
  options.held = from;
  py::gil_scoped_release release;
  SignalInterrupt interrupt;
  parallel_for(static_cast<int>(count), threads, 1, [&](int begin, int end) {
    EquilibriumSolver solver(*scene);
    for (int b = begin; b < end; ++b)
      all[b].at = solver.solve(all[b].inputs.data(), from, nullptr, options, &interrupt);
  });
  return all;
}

Solution solve(const std::shared_ptr<Scene>& scene, const Array& inputs, const std::optional<Array>& start,
               bool stable) {
  expect_size(inputs, scene->layout.total(), "inputs");
  return std::move(solve_batch(scene, inputs, start, stable, 1)[0]);
}

py::array_t<double> equilibrium_vjp(const Solution& s, const std::optional<Array>& x_bar,
                                    const std::optional<Array>& lambda_bar) {
  if (x_bar) expect_size(*x_bar, s.scene->dofs(), "x_bar");
  if (lambda_bar) expect_size(*lambda_bar, s.scene->multipliers(), "lambda_bar");
  std::vector<double> bar(s.inputs.size());
  {
    py::gil_scoped_release release;
    EquilibriumDerivative(*s.scene, s.inputs.data(), s.at)
        .vjp(x_bar ? x_bar->data() : nullptr, lambda_bar ? lambda_bar->data() : nullptr, bar.data());
  }
  return to_numpy(bar, {static_cast<py::ssize_t>(bar.size())});
}

// Calls f(derivative, b) for every solution of a batch, spread over threads. A solution that stands there again, as under jacrev and jacfwd,
// serves with its factors at hand.
template <class F>
void for_each_derivative(const std::vector<const Solution*>& solutions, int threads, F&& f) {
  std::vector<std::size_t> order(solutions.size());
  std::iota(order.begin(), order.end(), 0);
  const auto at = [&](std::size_t i) { return solutions[order[i]]; };
  std::ranges::stable_sort(order, std::less<>(), [&](std::size_t b) { return solutions[b]; });
  py::gil_scoped_release release;
  SignalInterrupt interrupt;
  parallel_for(static_cast<int>(order.size()), threads, 1, [&](int begin, int end) {
    std::optional<EquilibriumDerivative> derivative;
    for (int i = begin; i < end; ++i) {
      interrupt.poll();
      if (i == begin || at(i) != at(i - 1)) derivative.emplace(*at(i)->scene, at(i)->inputs.data(), at(i)->at);
      f(*derivative, order[i]);
    }
  });
}

// The scene of a batch of solutions.
const Scene& scene_of(const std::vector<const Solution*>& solutions) {
  if (solutions.empty()) throw std::invalid_argument("solutions: empty. Fix: give at least one");
  return *solutions[0]->scene;
}

// Gradients (B, total) from cotangents (B, dofs + multipliers) of coordinates and multipliers.
py::array_t<double> equilibria_vjp(const std::vector<const Solution*>& solutions, const Array& bar, int threads) {
  const Scene& scene = scene_of(solutions);
  const std::size_t total = scene.layout.total(), dofs = scene.dofs(), size = dofs + scene.multipliers();
  expect_size(bar, solutions.size() * size, "bar");
  py::array_t<double> out({solutions.size(), total});
  double* inputs_bar = out.mutable_data();
  std::fill_n(inputs_bar, out.size(), 0.0);
  const double* from = bar.data();
  for_each_derivative(solutions, threads, [&](const EquilibriumDerivative& derivative, std::size_t b) {
    derivative.vjp(from + b * size, from + b * size + dofs, inputs_bar + b * total);
  });
  return out;
}

// Tangents (B, dofs + multipliers) of coordinates and multipliers, each along a direction (B, total) of its own.
py::array_t<double> equilibria_jvp(const std::vector<const Solution*>& solutions, const Array& inputs_dot,
                                   int threads) {
  using D = Dual<double, 1>;
  const Scene& scene = scene_of(solutions);
  const std::size_t total = scene.layout.total(), dofs = scene.dofs(), size = dofs + scene.multipliers();
  expect_size(inputs_dot, solutions.size() * total, "inputs_dot");
  py::array_t<double> out({solutions.size(), size});
  double* tangents = out.mutable_data();
  const double* along = inputs_dot.data();
  for_each_derivative(solutions, threads, [&](const EquilibriumDerivative& derivative, std::size_t b) {
    std::vector<D> in(solutions[b]->inputs.begin(), solutions[b]->inputs.end()), states(size);
    for (std::size_t i = 0; i < total; ++i) in[i].d[0] = along[b * total + i];
    derivative.jvp(in.data(), states.data(), states.data() + dofs);
    for (std::size_t i = 0; i < size; ++i) tangents[b * size + i] = states[i].d[0];
  });
  return out;
}

py::tuple parts_of(const Solution& s) {
  const Equilibrium& at = s.at;
  return py::make_tuple(s.scene, s.inputs, at.x, at.lambda, at.energy, at.residual, at.iterations, at.unstable_modes,
                        at.converged, at.t0, at.force_stiffness, at.message);
}

Solution solution_of(const py::tuple& parts) {
  Equilibrium at;
  at.x = parts[2].cast<std::vector<double>>();
  at.lambda = parts[3].cast<std::vector<double>>();
  at.energy = parts[4].cast<double>();
  at.residual = parts[5].cast<double>();
  at.iterations = parts[6].cast<int>();
  at.unstable_modes = parts[7].cast<int>();
  at.converged = parts[8].cast<bool>();
  at.t0 = parts[9].cast<double>();
  at.force_stiffness = parts[10].cast<double>();
  at.message = parts[11].cast<std::string>();
  return {parts[0].cast<std::shared_ptr<Scene>>(), parts[1].cast<std::vector<double>>(), std::move(at)};
}

}  // namespace

void bind_equilibrium(py::module_& m) {
  py::class_<Solution>(m, "EquilibriumSolution")
      .def(py::pickle(&parts_of, &solution_of))
      .def_property_readonly(
          "positions", [](const Solution& s) { return to_numpy(s.at.x, {static_cast<py::ssize_t>(s.at.x.size())}); })
      .def_property_readonly(
          "multipliers",
          [](const Solution& s) { return to_numpy(s.at.lambda, {static_cast<py::ssize_t>(s.at.lambda.size())}); })
      .def_property_readonly("energy", [](const Solution& s) { return s.at.energy; })
      .def_property_readonly("residual", [](const Solution& s) { return s.at.residual; })
      .def_property_readonly("iterations", [](const Solution& s) { return s.at.iterations; })
      .def_property_readonly("unstable_modes", [](const Solution& s) { return s.at.unstable_modes; })
      .def_property_readonly("converged", [](const Solution& s) { return s.at.converged; })
      .def_property_readonly("redundant",
                             [](const Solution& s) { return describe(*s.scene, s.at.left_out, s.at.x.data()); })
      .def_property_readonly("message", [](const Solution& s) { return s.at.message; })
      .def("vjp", &equilibrium_vjp, py::arg("x_bar") = py::none(), py::arg("lambda_bar") = py::none());
  m.def("equilibrium", &solve, py::arg("scene"), py::arg("inputs"), py::arg("start") = py::none(),
        py::arg("stable") = true);
  m.def("equilibria", &solve_batch, py::arg("scene"), py::arg("inputs"), py::arg("start") = py::none(),
        py::arg("stable") = true, py::arg("threads") = 1);
  m.def("equilibria_vjp", &equilibria_vjp, py::arg("solutions"), py::arg("bar"), py::arg("threads") = 1);
  m.def("equilibria_jvp", &equilibria_jvp, py::arg("solutions"), py::arg("inputs_dot"), py::arg("threads") = 1);
}

}  // namespace sheetbend::bindings
