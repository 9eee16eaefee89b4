// The pairs of an implicit block that may touch in a substep, of one scene: found where the substep starts, for all that its particles reach on the way to
// where they would go freely; found again where Newton's method leads them farther. A step along which two would pass through each other is not taken, so
// that each pair stays on its side, however fast it moves.
#pragma once

#include <vector>

#include "core/contact/find_pairs.h"
#include "core/contact/meeting.h"
#include "core/scalar/numbers.h"
#include "core/solver/plan.h"

namespace sheetbend {

struct BlockPair {
  PairKey key;
  std::array<int, 4> particles;  // in the block's order, fixed ones included
  PairNumbers<double> numbers;
  auto operator<=>(const BlockPair& other) const { return key <=> other.key; }
};

// Coordinates (12) of a pair in rows of four.
inline void gather(const BlockPair& pair, const double* rows, double* x) {
  gather(pair.particles, rows, sheetbend_blocks::row, x);
}

class BlockPairs {
 public:
  // The radii (per particle of the block), and rigidity (eta/h)^2.
  std::vector<double> radius;
  double stiffness = 0.0;

  // Of its lists, which grow with what touches: estimated by a few pairs per edge and triangle.
  static std::size_t bytes(const DirectBlock& block);

  bool empty() const { return pairs_.empty(); }
  const std::vector<BlockPair>& all() const { return pairs_; }

  // Finds the pairs on the way from a state (rows of four with inverse masses) to where the movable particles would go and the fixed ones do; or at one.
  void find(const DirectBlock& block, Numbers<double>& from, Numbers<double>& guess, Numbers<double>& target);
  void find_at(const DirectBlock& block, Numbers<double>& rows);

  // Whether the particles can go straight from one state to the other without that two pass through each other. What goes farther than was looked for is
  // looked for.
  bool can_go(const DirectBlock& block, Numbers<double>& from, Numbers<double>& to);

  // A pair that passes through on the way, or null.
  const BlockPair* passing(Numbers<double>& from, Numbers<double>& to) const;

  // Whether one touches at `next` that did not at `now`.
  bool begins(Numbers<double>& now, Numbers<double>& next) const;

 private:
  void search(const DirectBlock& block);

  std::vector<BlockPair> pairs_;
  Numbers<double> origin_;     // where the particles' reach counts from
  std::vector<double> reach_;  // per particle
};

}  // namespace sheetbend
