// The parts of sheetbend._core, one file each.
#pragma once

#include "adjoint/observe/parameter_map.h"
#include "python/bindings/arrays.h"

namespace sheetbend::bindings {

ParameterMap make_map(const py::dict& d);

void bind_kinds(py::module_& m);
void bind_map(py::module_& m);
void bind_scene(py::module_& m);
void bind_rollout(py::module_& m);
void bind_equilibrium(py::module_& m);
void bind_values(py::module_& m);
void bind_problem(py::module_& m);
void bind_stepper(py::module_& m);

}  // namespace sheetbend::bindings
