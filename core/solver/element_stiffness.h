// The stiffness of one constraint with its multipliers, J^T J/D - sum lambda_j Hess(C_j).
#pragma once

#include <vector>

#include "core/constraints/registry.h"

namespace sheetbend {

// Kinds on points alone that always hold: those an implicit block takes.
template <class K>
inline constexpr bool holds_points = K::points == K::arity && !K::unilateral;

// E (dofs, dofs) at x (dofs) and the constraint's own parameters; `stiffness` is 1/D.
void element_stiffness(int kind, const double* x, const double* parameters, double stiffness, const double* lambda,
                       double* E);

// E (dofs, dofs) without its negative eigenvalues.
void make_convex(int dofs, double* E);

}  // namespace sheetbend
