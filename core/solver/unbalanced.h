// The error of substeps whose forces do not balance.
#pragma once

#include <string>

#include "core/linear/conjugate_gradients.h"

namespace sheetbend {

// The forces of a substep do not balance after as many Newton matrices as it may take; or they do where K is singular, and have no derivative. Between
// sweeps: a particle finds no place on the surface of a collider.
struct Unbalanced : Unconverged {
  std::string problem, fix;
  int substep = -1, node;  // node: the particle whose forces balance worst
  double time = 0.0;
  Unbalanced(const std::string& problem, const std::string& fix, int matrices, double residual, int node);
  Unbalanced(const Unbalanced& e, int substep, double time);  // the same, saying when
};

}  // namespace sheetbend
