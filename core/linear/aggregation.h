// What the preconditioner of conjugate gradients knows about a block: which particles are coupled in H, and aggregates of neighbors that move as
// rigid bodies on the coarse level (Vanek, Mandel & Brezina 1996, without their smoothing). Found once per plan from the graph alone.
#pragma once

#include <vector>

#include "core/linear/condensed_shares.h"
#include "core/linear/symmetric_factor.h"

namespace sheetbend {

struct Aggregation {
  CondensedShares shares;
  // H's lower triangle by rows of 3 x 3 blocks: the particles before a particle that share a constraint with it, then the particle itself.
  std::vector<int> start{0}, column;
  std::vector<int> entry;  // per pair of the shares: its block of H

  static constexpr int modes = 6;  // of a rigid body
  std::vector<int> dof_of;         // per particle: the first dof of its aggregate in the coarse matrix
  FactorStructure coarse{0, {}, false};
  std::vector<std::size_t> coarse_column;  // per block of the coarse matrix: where its columns stand there
  std::vector<int> coarse_entry;           // per block of H: its block of the coarse matrix

  Aggregation(int particles, CondensedShares shares_);
  int aggregates() const { return coarse.size() / modes; }
  std::size_t bytes() const;

 private:
  std::vector<int> find_couplings(int particles);  // and how many constraints share each
  void find_coarse(const std::vector<int>& aggregate, int count);
};

}  // namespace sheetbend
