// J and the Hessians of one constraint whose kind is a number (core/constraints/any_kind.h), compiled once per kind.
#pragma once

#include "core/constraints/any_kind.h"

namespace sheetbend {

// Writes J, and adds sum_j lambda_j Hess(C_j), the lower triangle row after row, to H.
void add_hessian(int kind, const double* x, const double* p, const double* lambda, double* J, double* H);

}  // namespace sheetbend
