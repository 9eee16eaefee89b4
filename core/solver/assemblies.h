// Which particles an impact of balls pushes besides the two: those that constraints join to them.
#pragma once

#include "core/solver/plan.h"

namespace sheetbend {

// Fills Plan::assemblies and assembly_of_ball.
void assemble_balls(const Scene& scene, Plan& plan);

}  // namespace sheetbend
