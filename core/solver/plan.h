// A solver is a partition of the constraints into blocks. Blocks of one go by color (nonlinear Gauss-Seidel: constraints of one color
// share no movable particle); a connected set can be one direct block. The plan is found once per scene and shared.
#pragma once

#include <vector>

#include "core/packs/packed_colors.h"
#include "core/scene/scene.h"
#include "core/solver/options.h"
#include "core/solver/symmetric_factor.h"

namespace sheetbend {

// A reference to constraint `item` of group `group`.
struct Member {
  int group, item;
  int first_row;  // in the block's matrix
};

// The coupling of two constraints through one shared node: A[i, j] += w J_i[node] J_j[node]^T.
struct Coupling {
  int row_member, column_member, node, row_slot, column_slot;
  int first_position;  // into DirectBlock::position: rows_i x rows_j entries, row-major (upper ones of a diagonal pair are -1)
};

struct DirectBlock {
  std::vector<Member> members;  // in elimination order
  std::vector<int> nodes;       // movable nodes it touches
  int first_row = 0;            // blocks' rows one after the other
  std::vector<Coupling> couplings;
  std::vector<int> position;
  FactorStructure structure;
};

struct Plan {
  SolverOptions options;
  std::vector<Color> colors;
  PackPlan packs;  // the same colors, eight constraints at a time
  std::vector<DirectBlock> blocks;
};

// Whether this plan's constraints go through the kernels of core/packs.
template <class T>
bool sweeps_packs(const Plan& plan) {
  return in_packs<T> && !plan.colors.empty();
}

Plan make_plan(const Scene& scene, const SolverOptions& options);

}  // namespace sheetbend
