// The module sheetbend._ceres, loaded when a fit with Ceres starts.
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "adjoint/fit/ceres_fit.h"

namespace py = pybind11;
using namespace sheetbend;

namespace {

// observe(iteration, cost, step_norm, gradient_max, u) -> bool: go on?
py::dict minimize(const py::capsule& evaluation, std::vector<double> u, const std::vector<double>& lower,
                  const std::vector<double>& upper, std::vector<double> longest_step, std::vector<int> held,
                  double residual_seconds, int max_iterations, double tolerance, const py::function& observe) {
  const auto* function =
      static_cast<const EvaluationFunction*>(PyCapsule_GetPointer(evaluation.ptr(), EvaluationFunction::capsule_name));
  if (function == nullptr) throw py::error_already_set();
  if (static_cast<int>(u.size()) != function->parameters) throw std::invalid_argument("u: does not fit the problem");
  if (longest_step.size() != u.size() || lower.size() != u.size() || upper.size() != u.size())
    throw std::invalid_argument("bounds, longest_step: do not fit u");
  CeresOptions options;
  options.longest_step = std::move(longest_step);
  options.held = std::move(held);
  options.residual_seconds = residual_seconds;
  options.max_iterations = max_iterations;
  options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = tolerance;
  std::exception_ptr raised;
  const Observe watch = [&](const CeresProgress& p, const std::vector<double>& at) {
    py::gil_scoped_acquire gil;
    try {
      return observe(p.iteration, p.cost, p.step_norm, p.gradient_max, at).cast<bool>();
    } catch (...) {
      raised = std::current_exception();
      return false;
    }
  };
  CeresResult r;
  {
    py::gil_scoped_release release;
    r = minimize_with_ceres(*function, std::move(u), lower, upper, options, watch);
  }
  if (raised) std::rethrow_exception(raised);
  py::dict out;
  out["u"] = r.u;
  out["cost"] = r.cost;
  out["iterations"] = r.iterations;
  out["evaluations"] = r.evaluations;
  out["jacobians"] = r.jacobians;
  out["converged"] = r.converged;
  out["stopped"] = r.stopped;
  out["message"] = r.message;
  if (!r.residual.empty()) {
    out["residual"] = py::array_t<double>(static_cast<py::ssize_t>(r.residual.size()), r.residual.data());
    out["jacobian"] = py::array_t<double>(
        {static_cast<py::ssize_t>(r.residual.size()), static_cast<py::ssize_t>(r.u.size())}, r.jacobian.data());
  }
  return out;
}

}  // namespace

PYBIND11_MODULE(_ceres, m) {
  m.doc() = "Levenberg-Marquardt by Ceres on a sheetbend problem.";
  m.def("minimize", &minimize, py::kw_only(), py::arg("evaluation"), py::arg("u"), py::arg("lower"), py::arg("upper"),
        py::arg("longest_step"), py::arg("held"), py::arg("residual_seconds") = 0.0, py::arg("max_iterations"),
        py::arg("tolerance"), py::arg("observe"));
}
