// What solvers refuse.
#pragma once

#include "core/scene/scene.h"
#include "core/solver/options.h"

namespace sheetbend {

// Throws std::invalid_argument("field: what, got, fix") for options out of range, and for a scene that this method does not take.
void check_solver(const Scene& scene, const SolverOptions& options);

}  // namespace sheetbend
