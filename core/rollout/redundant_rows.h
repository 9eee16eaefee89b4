// Rows of constraints that others say already: both diagonals of a flat square of rigid links, a door on two hinges. A direct block leaves them out
// (core/scalar/pivot.h); here they are found at a state, and named, so that nobody takes their forces and rest values for what they are not.
#pragma once

#include <string>
#include <vector>

#include "core/solver/plan.h"

namespace sheetbend {

struct RedundantRow {
  int row;                  // of the scene's multipliers: the one that is left out
  std::vector<int> others;  // the rows that say it already
  double
      contradiction;  // by how much of a length (of an angle for rows between directions) they disagree about it there
};

// The rows that the blocks of a plan leave out of a projection at x (dofs), with inverse masses w (nodes) and eta as in element.h. With an eta of
// almost zero only rigid rows count: what gives way then gives way without end.
std::vector<RedundantRow> redundant_rows(const Scene& scene, const Plan& plan, const double* inputs, const double* x,
                                         const double* w, double eta);

// Those of a rollout's first substep from the initial state.
std::vector<RedundantRow> redundant_rows(const Scene& scene, const Plan& plan, const double* inputs, double t0);

// The constraints of these rows and of those that they follow from, ascending; volumes count on behind the constraints. One of them that gets a compliance
// makes room for another, so that the motion jumps from one derivative with respect to it to another.
std::vector<int> constraints_among(const Scene& scene, const std::vector<RedundantRow>& rows);

// The group that a row of the constraints' multipliers belongs to.
const Group& group_of(const Scene& scene, int row);

// Which constraints they are, in words; empty where there are none. Contradictions are told from 1e-6 of the scene's size at x (dofs) on.
std::string describe(const Scene& scene, const std::vector<RedundantRow>& rows, const double* x);

}  // namespace sheetbend
