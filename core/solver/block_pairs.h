// The pairs of an implicit block that may touch, of one scene: found where the substep starts, for the way on which its particles would go freely, and again
// for each step of Newton's method that leads away from what was looked for. A step along which two would pass through each other is not taken, so that each
// pair stays on its side, however fast it moves. Points of bodies go straight where their nodes do, so that the same bounds hold for them.
#pragma once

#include <vector>

#include "core/contact/find_pairs.h"
#include "core/contact/meeting.h"
#include "core/contact/spots.h"
#include "core/scalar/numbers.h"
#include "core/solver/plan.h"

namespace sheetbend {

struct BlockPair {
  PairKey key;
  std::array<int, 4> spots;  // in the block's order, fixed ones included
  PairNumbers<double> numbers;
  auto operator<=>(const BlockPair& other) const { return key <=> other.key; }
};

class BlockPairs {
 public:
  // The radii (per spot of the block), rigidity (eta/h)^2, and where spots are.
  std::vector<double> radius;
  double stiffness = 0.0;
  Spots<double> spots;

  // Of its lists, which grow with what touches: estimated by a few pairs per edge and triangle.
  static std::size_t bytes(const DirectBlock& block);

  bool empty() const { return pairs_.empty(); }
  const std::vector<BlockPair>& all() const { return pairs_; }
  // Coordinates of a spot, and those (12) of a pair, in rows of four.
  Vec3<double> at(int spot, const double* rows) const {
    return spots.at(spot, [&](int particle) { return Vec3<double>(rows + sheetbend_blocks::row * particle); });
  }
  void gather(const BlockPair& pair, const double* rows, double* x) const {
    for (int k = 0; k < 4; ++k) at(pair.spots[k], rows).store(x + 3 * k);
  }

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
  void start_from(const DirectBlock& block, Numbers<double>& rows);
  void search(const DirectBlock& block);
  void follow(const DirectBlock& block, Numbers<double>& from, Numbers<double>& to);
  bool holds(const DirectBlock& block, Numbers<double>& rows);
  double beside(int spot, Numbers<double>& rows, double share);
  double share_gone(const DirectBlock& block, Numbers<double>& rows);
  bool touches_anything(const DirectBlock& block, int spot) const { return block.surface.radius[spot] >= 0; }
  bool can_move(const DirectBlock& block, int spot) const { return block.surface.whole(spot) < block.movable; }
  Vec3<double> way(int spot) const { return Vec3<double>(&way_[3 * static_cast<std::size_t>(spot)]); }

  std::vector<BlockPair> pairs_;
  // Where a spot may be, while the list has all pairs that touch: no farther than its reach from where it is on its way from the origin, all spots at the
  // same share of their ways.
  Numbers<double> origin_;           // rows of four with inverse masses, per spot
  std::vector<double> reach_;        // per spot
  std::vector<double> way_;          // (spots, 3)
  std::vector<Vec3<double>> start_;  // of the substep
  std::vector<double> limit_;        // how far from there it may go at most
};

}  // namespace sheetbend
