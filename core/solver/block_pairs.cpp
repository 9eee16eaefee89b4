#include "core/solver/block_pairs.h"

#include <algorithm>
#include <cmath>

namespace sheetbend {
namespace {

using sheetbend_blocks::row;

constexpr double margin = 0.1;       // beyond the free motion, of the radius
constexpr double farther = 1.5;      // than asked for, where particles leave what was looked for
constexpr double farthest = 8.0;     // that a step may lead, of the free motion and the radius: pairs would be too many
constexpr double nearest_yet = 0.1;  // that two may come, of where they touch
constexpr int most_advances = 64;
constexpr std::size_t usual_pairs = 4;  // per edge and triangle

double distance_between(const double* a, const double* b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

// Whether two come too near while their nodes go straight from x by `d`: by conservative advancement, as in Li et al. (2021), sec. 4.
bool passes(bool triangle, const double* x, double* d, const PairNumbers<double>& n) {
  double mean[3] = {0.0, 0.0, 0.0}, speed[4], at[12], ends[2][12];
  for (int i = 0; i < 12; ++i) mean[i % 3] += 0.25 * d[i];
  for (int i = 0; i < 12; ++i) {
    d[i] -= mean[i % 3];
    ends[0][i] = x[i], ends[1][i] = x[i] + d[i];
  }
  const double least = nearest_yet * n.touching;
  if (boxes_are_apart(triangle, ends, 2, least)) return false;
  for (int k = 0; k < 4; ++k) speed[k] = std::hypot(d[3 * k], d[3 * k + 1], d[3 * k + 2]);
  const double approach = triangle ? speed[0] + std::max({speed[1], speed[2], speed[3]})
                                   : std::max(speed[0], speed[1]) + std::max(speed[2], speed[3]);
  double t = 0.0;
  for (int advance = 0; advance < most_advances; ++advance) {
    for (int i = 0; i < 12; ++i) at[i] = x[i] + t * d[i];
    const double room = distance_of(triangle, at, n) - least;
    if (!(room > 0.0)) return true;
    if (room >= (1.0 - t) * approach) return false;
    t += room / approach;
  }
  return true;
}

}  // namespace

std::size_t BlockPairs::bytes(const DirectBlock& block) {
  if (block.surface.empty()) return 0;
  return sizeof(BlockPair) * usual_pairs * (block.surface.edges.size() + block.surface.triangles.size()) +
         2 * sizeof(double) * block.particles.size() + Numbers<double>::bytes(row * block.particles.size());
}

void BlockPairs::find(const DirectBlock& block, Numbers<double>& from, Numbers<double>& guess,
                      Numbers<double>& target) {
  pairs_.clear();
  if (block.surface.empty()) return;
  origin_ = from;
  const int count = static_cast<int>(block.particles.size());
  reach_.assign(2 * count, 0.0);
  double driven = 0.0;
  for (int p = 0; p < count; ++p) {
    if (block.surface.radius[p] < 0) continue;
    const double* at = from.data() + row * p;
    const double forced = distance_between(at, target.data() + row * p);
    const double way = p < block.movable ? std::max(forced, distance_between(at, guess.data() + row * p)) : forced;
    reach_[p] = reach_[count + p] = (std::isfinite(way) ? way : 0.0) + margin * radius[p];
    if (p >= block.movable) driven = std::max(driven, reach_[p]);
  }
  for (int p = 0; p < count; ++p) reach_[count + p] = farthest * (reach_[count + p] + driven + radius[p]);
  search(block);
}

void BlockPairs::find_at(const DirectBlock& block, Numbers<double>& rows) {
  pairs_.clear();
  if (block.surface.empty()) return;
  origin_ = rows;
  reach_.assign(2 * block.particles.size(), 0.0);
  search(block);
}

void BlockPairs::search(const DirectBlock& block) {
  pairs_.clear();
  for (const PairKey& key : find_pairs(block.surface, {origin_.data(), row, radius.data(), reach_.data()})) {
    BlockPair pair{key, nodes_of(block.surface, key), {}};
    double w[4], sum = 0.0;
    for (int k = 0; k < 4; ++k)
      sum += w[k] = pair.particles[k] < block.movable ? origin_[row * pair.particles[k] + 3] : 0.0;
    if (!(sum > 0.0)) continue;  // nothing of it moves
    const int second = pair.particles[key.triangle ? 1 : 2];
    pair.numbers = pair_numbers(key.triangle, radius[pair.particles[0]], radius[second], w, stiffness);
    pairs_.push_back(pair);
  }
}

bool BlockPairs::can_go(const DirectBlock& block, Numbers<double>& from, Numbers<double>& to) {
  if (block.surface.empty()) return true;
  bool leaves = false;
  for (int p = 0; p < block.movable; ++p) {
    if (block.surface.radius[p] < 0) continue;
    const double away = distance_between(origin_.data() + row * p, to.data() + row * p);
    if (away <= reach_[p]) continue;
    if (!(away <= reach_[block.particles.size() + p])) return false;
    reach_[p] = std::min(farther * away, reach_[block.particles.size() + p]);
    leaves = true;
  }
  if (leaves) search(block);
  return !passing(from, to);
}

const BlockPair* BlockPairs::passing(Numbers<double>& from, Numbers<double>& to) const {
  for (const BlockPair& pair : pairs_) {
    double x[12], d[12];
    gather(pair, from.data(), x);
    gather(pair, to.data(), d);
    for (int i = 0; i < 12; ++i) d[i] -= x[i];
    if (passes(pair.key.triangle, x, d, pair.numbers)) return &pair;
  }
  return nullptr;
}

bool BlockPairs::begins(Numbers<double>& now, Numbers<double>& next) const {
  return std::any_of(pairs_.begin(), pairs_.end(), [&](const BlockPair& pair) {
    double x[12];
    gather(pair, next.data(), x);
    if (!touches(pair.key.triangle, x, pair.numbers)) return false;
    gather(pair, now.data(), x);
    return !touches(pair.key.triangle, x, pair.numbers);
  });
}

}  // namespace sheetbend
