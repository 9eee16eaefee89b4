// Static equilibrium from Python.
#include "core/equilibrium/equilibrium.h"

#include <optional>

#include "python/bindings/core_module.h"
#include "python/bindings/interrupt.h"

namespace sheetbend::bindings {

void bind_equilibrium(py::module_& m) {
  m.def(
      "equilibrium",
      [](const std::shared_ptr<Scene>& scene, const Array& inputs, const std::optional<Array>& start, bool stable) {
        expect_size(inputs, scene->layout.total(), "inputs");
        if (start) expect_size(*start, scene->dofs(), "start");
        Equilibrium e;
        {
          py::gil_scoped_release release;
          SignalInterrupt interrupt;
          EquilibriumOptions options;
          options.stable = stable;
          e = EquilibriumSolver(*scene).solve(inputs.data(), start ? start->data() : nullptr, nullptr, options, &interrupt);
        }
        py::dict out;
        out["positions"] = to_numpy(e.x, {static_cast<py::ssize_t>(e.x.size())});
        out["multipliers"] = to_numpy(e.lambda, {static_cast<py::ssize_t>(e.lambda.size())});
        out["energy"] = e.energy;
        out["residual"] = e.residual;
        out["iterations"] = e.iterations;
        out["unstable_modes"] = e.unstable_modes;
        out["converged"] = e.converged;
        out["message"] = e.message;
        return out;
      },
      py::arg("scene"), py::arg("inputs"), py::arg("start"), py::arg("stable"));
}

}  // namespace sheetbend::bindings
