// The pairs of an implicit block that may touch, of one scene: found where the substep starts, for the way on which its particles would go freely, and again
// for each step of Newton's method that leads away from what was looked for. A step along which two would pass through each other is not taken, so that each
// pair stays on its side, however fast it moves.
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

  // Whether the particles can go straight from one state to the other without that two pass through each other; looks for pairs on that way.
  bool can_go(const DirectBlock& block, Numbers<double>& from, Numbers<double>& to);
  // Looks for those that touch at a state where no way has led to.
  void stay(const DirectBlock& block, Numbers<double>& rows);

  // A pair that passes through on the way, or null.
  const BlockPair* passing(Numbers<double>& from, Numbers<double>& to) const;

  // Whether one touches at `next` that did not at `now`.
  bool begins(Numbers<double>& now, Numbers<double>& next) const;

 private:
  void search(const DirectBlock& block);
  void follow(const DirectBlock& block, Numbers<double>& from, Numbers<double>& to);
  bool holds(const DirectBlock& block, Numbers<double>& rows);
  double beside(int particle, Numbers<double>& rows, double share);
  double share_gone(const DirectBlock& block, Numbers<double>& rows);

  std::vector<BlockPair> pairs_;
  // Where a particle may be, while the list has all pairs that touch: no farther than its reach from where it is on its way from the origin, all particles at
  // the same share of their ways.
  struct Freedom {
    double reach, way[3];
    double start[3], limit;  // of the substep, and how far from there it may go at most
  };
  Numbers<double> origin_;
  std::vector<Freedom> freedom_;  // per particle
};

}  // namespace sheetbend
