// The module sheetbend._core: scenes, rollouts and their derivatives, equilibria, least-squares problems.
#include "python/bindings/core_module.h"

#include "adjoint/equilibrium/equilibrium_tangents.h"
#include "adjoint/tape/tape_plan.h"
#include "core/packs/instruction_sets.h"
#include "core/rollout/rollout.h"
#include "python/bindings/interrupt.h"

PYBIND11_MODULE(_core, m) {
  using namespace sheetbend;
  using namespace sheetbend::bindings;
  m.doc() =
      "Compiled core of sheetbend. Use the package's Python functions; this module's shapes are flat and unchecked "
      "beyond sizes.";
  m.def("instruction_set", [] { return pack_kernels().name; });
  m.def("compiled_instruction_sets", &compiled_instruction_sets);
  static py::exception<Diverged> diverged(m, "Diverged", PyExc_RuntimeError);
  static py::exception<Unconverged> unconverged(m, "Unconverged", PyExc_RuntimeError);
  static py::exception<Unbalanced> unbalanced(m, "Unbalanced", unconverged);
  static py::exception<NoEquilibrium> no_equilibrium(m, "NoEquilibrium", PyExc_RuntimeError);
  static py::exception<BudgetTooSmall> too_small(m, "BudgetTooSmall", PyExc_ValueError);
  // NOLINTNEXTLINE(performance-unnecessary-value-param)
  py::register_exception_translator([](std::exception_ptr p) {
    try {
      if (p) std::rethrow_exception(p);
    } catch (const Diverged& e) {
      py::object error = py::handle(diverged)(e.what());
      error.attr("substep") = e.substep;
      error.attr("particle") = e.node;
      error.attr("time") = e.time;
      error.attr("seen") = e.seen;
      PyErr_SetObject(diverged.ptr(), error.ptr());
    } catch (const BudgetTooSmall& e) {
      py::object error = py::handle(too_small)(e.what());
      error.attr("needed") = e.needed;
      PyErr_SetObject(too_small.ptr(), error.ptr());
    } catch (const Unbalanced& e) {
      py::object error = py::handle(unbalanced)(e.what());
      error.attr("iterations") = e.iterations;
      error.attr("residual") = e.residual;
      error.attr("problem") = e.problem;
      error.attr("fix") = e.fix;
      error.attr("substep") = e.substep;
      error.attr("particle") = e.node;
      error.attr("time") = e.time;
      PyErr_SetObject(unbalanced.ptr(), error.ptr());
    } catch (const Unconverged& e) {
      py::object error = py::handle(unconverged)(e.what());
      error.attr("iterations") = e.iterations;
      error.attr("residual") = e.residual;
      PyErr_SetObject(unconverged.ptr(), error.ptr());
    } catch (const NoEquilibrium& e) {
      PyErr_SetString(no_equilibrium.ptr(), e.what());
    } catch (const Interrupted&) {
      PyErr_SetNone(PyExc_KeyboardInterrupt);
    }
  });
  bind_kinds(m);
  bind_map(m);
  bind_scene(m);
  bind_rollout(m);
  bind_equilibrium(m);
  bind_values(m);
  bind_problem(m);
  bind_stepper(m);
}
