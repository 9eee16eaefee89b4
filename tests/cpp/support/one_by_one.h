// The projection of single constraints over doubles, and its reverse, which tests compare kernels with: compiled once for all tests (one_by_one.cpp).
#pragma once

#include "adjoint/solver/project_vjp.h"
#include "core/solver/project.h"

namespace sheetbend {

extern template void project_color(const SubstepState<double>&, const SolverOptions&, const Color&,
                                   IterationRecord<double>&);
extern template void project_color_vjp(const SubstepState<double>&, const SolverOptions&, const Color&,
                                       const IterationRecord<double>&, const SubstepCotangent<double>&);

}  // namespace sheetbend
