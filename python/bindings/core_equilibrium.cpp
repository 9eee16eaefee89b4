// Static equilibrium from Python: the solution and its derivative.
#include "core/equilibrium/equilibrium.h"

#include <memory>
#include <optional>

#include "adjoint/equilibrium_vjp.h"
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

py::array_t<double> vjp(const Solution& s, const std::optional<Array>& x_bar, const std::optional<Array>& lambda_bar) {
  if (x_bar) expect_size(*x_bar, s.scene->dofs(), "x_bar");
  if (lambda_bar) expect_size(*lambda_bar, s.scene->rows, "lambda_bar");
  std::vector<double> bar(s.inputs.size());
  {
    py::gil_scoped_release release;
    EquilibriumDerivative(*s.scene, s.inputs.data(), s.at)
        .vjp(x_bar ? x_bar->data() : nullptr, lambda_bar ? lambda_bar->data() : nullptr, bar.data());
  }
  return to_numpy(bar, {static_cast<py::ssize_t>(bar.size())});
}

// Gradients (B, total) from cotangents (B, dofs + rows) of coordinates and multipliers.
py::array_t<double> vjp_batch(const std::vector<const Solution*>& solutions, const Array& bar, int threads) {
  if (solutions.empty()) throw std::invalid_argument("solutions: empty. Fix: give at least one");
  const Scene& scene = *solutions[0]->scene;
  const std::size_t total = scene.layout.total(), size = scene.dofs() + scene.rows;
  expect_size(bar, solutions.size() * size, "bar");
  py::array_t<double> out({solutions.size(), total});
  double* inputs_bar = out.mutable_data();
  std::fill_n(inputs_bar, out.size(), 0.0);
  const double* from = bar.data();
  py::gil_scoped_release release;
  parallel_for(static_cast<int>(solutions.size()), threads, 1, [&](int begin, int end) {
    for (int b = begin; b < end; ++b)
      EquilibriumDerivative(scene, solutions[b]->inputs.data(), solutions[b]->at)
          .vjp(from + b * size, from + b * size + scene.dofs(), inputs_bar + b * total);
  });
  return out;
}

// (x_dot, lambda_dot) along one direction of the inputs.
py::tuple jvp(const Solution& s, const Array& inputs_dot) {
  using D = Dual<double, 1>;
  expect_size(inputs_dot, s.inputs.size(), "inputs_dot");
  std::vector<D> in(s.inputs.begin(), s.inputs.end()), x(s.scene->dofs()), lambda(s.scene->rows);
  for (std::size_t i = 0; i < in.size(); ++i) in[i].d[0] = inputs_dot.data()[i];
  {
    py::gil_scoped_release release;
    EquilibriumDerivative(*s.scene, s.inputs.data(), s.at).jvp(in.data(), x.data(), lambda.data());
  }
  const auto tangents = [](const std::vector<D>& a) {
    py::array_t<double> out(static_cast<py::ssize_t>(a.size()));
    for (std::size_t i = 0; i < a.size(); ++i) out.mutable_data()[i] = a[i].d[0];
    return out;
  };
  return py::make_tuple(tangents(x), tangents(lambda));
}

}  // namespace

void bind_equilibrium(py::module_& m) {
  py::class_<Solution>(m, "EquilibriumSolution")
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
      .def_property_readonly("message", [](const Solution& s) { return s.at.message; })
      .def("vjp", &vjp, py::arg("x_bar") = py::none(), py::arg("lambda_bar") = py::none())
      .def("jvp", &jvp, py::arg("inputs_dot"));
  m.def("equilibrium", &solve, py::arg("scene"), py::arg("inputs"), py::arg("start") = py::none(),
        py::arg("stable") = true);
  m.def("equilibria", &solve_batch, py::arg("scene"), py::arg("inputs"), py::arg("start") = py::none(),
        py::arg("stable") = true, py::arg("threads") = 1);
  m.def("equilibria_vjp", &vjp_batch, py::arg("solutions"), py::arg("bar"), py::arg("threads") = 1);
}

}  // namespace sheetbend::bindings
