// Static equilibrium from Python: the solution and its derivative.
#include "core/equilibrium/equilibrium.h"

#include <memory>
#include <optional>

#include "adjoint/equilibrium_vjp.h"
#include "python/bindings/core_module.h"
#include "python/bindings/interrupt.h"

namespace sheetbend::bindings {
namespace {

struct Solution {
  std::shared_ptr<Scene> scene;
  std::vector<double> inputs;
  Equilibrium at;
};

Solution solve(std::shared_ptr<Scene> scene, const Array& inputs, const std::optional<Array>& start, bool stable) {
  expect_size(inputs, scene->layout.total(), "inputs");
  if (start) expect_size(*start, scene->dofs(), "start");
  Solution s{std::move(scene), {inputs.data(), inputs.data() + inputs.size()}, {}};
  py::gil_scoped_release release;
  SignalInterrupt interrupt;
  EquilibriumOptions options;
  options.stable = stable;
  s.at =
      EquilibriumSolver(*s.scene).solve(s.inputs.data(), start ? start->data() : nullptr, nullptr, options, &interrupt);
  return s;
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
}

}  // namespace sheetbend::bindings
