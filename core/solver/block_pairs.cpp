#include "core/solver/block_pairs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/contact/approach.h"

namespace sheetbend {
namespace {

using sheetbend_blocks::row;

constexpr double margin = 0.1;       // beside the ways that were looked for, of the radius
constexpr double farthest = 8.0;     // that a step may lead, of the free motion and the radius: pairs would be too many
constexpr double nearest_yet = 0.1;  // that two may come, of where they touch
constexpr std::size_t usual_pairs = 4;  // per edge and triangle

double distance_between(const double* a, const double* b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

// Of shares with weights: half of the weight is on either side. They are sorted.
double median(std::vector<std::pair<double, double>>& shares) {
  std::sort(shares.begin(), shares.end());
  double all = 0.0, below = 0.0;
  for (const auto& [share, weight] : shares) all += weight;
  for (const auto& [share, weight] : shares)
    if ((below += weight) >= 0.5 * all) return share;
  return 1.0;
}

}  // namespace

std::size_t BlockPairs::bytes(const DirectBlock& block) {
  if (block.surface.empty()) return 0;
  return sizeof(BlockPair) * usual_pairs * (block.surface.edges.size() + block.surface.triangles.size()) +
         sizeof(Freedom) * block.particles.size() + Numbers<double>::bytes(row * block.particles.size());
}

void BlockPairs::find(const DirectBlock& block, Numbers<double>& from, Numbers<double>& guess,
                      Numbers<double>& target) {
  pairs_.clear();
  if (block.surface.empty()) return;
  origin_ = from;
  const int count = static_cast<int>(block.particles.size());
  freedom_.assign(count, {});
  double driven = 0.0;
  for (int p = 0; p < count; ++p) {
    if (block.surface.radius[p] < 0) continue;
    const double *at = from.data() + row * p, *free = guess.data() + row * p, *forced = target.data() + row * p;
    const bool moves = p < block.movable;
    const double far = std::max(distance_between(at, forced), moves ? distance_between(at, free) : 0.0);
    Freedom& f = freedom_[p];
    std::copy_n(at, 3, f.start);
    f.limit = f.reach = margin * radius[p];
    if (!std::isfinite(far)) continue;
    f.limit += far;
    f.reach += moves ? distance_between(free, forced) : far;  // a fixed one does not go with the others
    if (moves)
      for (int d = 0; d < 3; ++d) f.way[d] = free[d] - at[d];
    else
      driven = std::max(driven, f.limit);
  }
  for (int p = 0; p < count; ++p) freedom_[p].limit = farthest * (freedom_[p].limit + driven + radius[p]);
  search(block);
}

void BlockPairs::find_at(const DirectBlock& block, Numbers<double>& rows) {
  pairs_.clear();
  if (block.surface.empty()) return;
  origin_ = rows;
  freedom_.assign(block.particles.size(), {});
  search(block);
}

void BlockPairs::search(const DirectBlock& block) {
  pairs_.clear();
  std::vector<double> reach, way;
  for (const Freedom& f : freedom_) {
    reach.push_back(f.reach);
    way.insert(way.end(), f.way, f.way + 3);
  }
  for (const PairKey& key : find_pairs(block.surface, {origin_.data(), row, radius.data(), reach.data(), way.data()})) {
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

// For the way from one state to another.
void BlockPairs::follow(const DirectBlock& block, Numbers<double>& from, Numbers<double>& to) {
  origin_ = from;
  for (int p = 0; p < static_cast<int>(block.particles.size()); ++p) {
    freedom_[p].reach = margin * radius[p];
    for (int d = 0; d < 3; ++d) freedom_[p].way[d] = to[row * p + d] - from[row * p + d];
  }
  search(block);
}

// How far a particle is from that share of its way.
double BlockPairs::beside(int particle, Numbers<double>& rows, double share) {
  const double *from = &origin_[row * particle], *way = freedom_[particle].way;
  const double there[3] = {from[0] + share * way[0], from[1] + share * way[1], from[2] + share * way[2]};
  return distance_between(there, &rows[row * particle]);
}

// The share of their ways that most particles have gone: all of it, unless a step was shortened.
double BlockPairs::share_gone(const DirectBlock& block, Numbers<double>& rows) {
  std::vector<std::pair<double, double>> shares;  // of each particle, with how long its way is
  for (int p = 0; p < block.movable; ++p) {
    if (block.surface.radius[p] < 0) continue;
    const Vec3<double> way(freedom_[p].way), gone = Vec3<double>(&rows[row * p]) - Vec3<double>(&origin_[row * p]);
    if (const double squared = dot(way, way); squared > 0.0)
      shares.emplace_back(dot(way, gone) / squared, std::sqrt(squared));
  }
  return std::clamp(median(shares), 0.0, 1.0);
}

// Whether the list has all pairs that touch there.
bool BlockPairs::holds(const DirectBlock& block, Numbers<double>& rows) {
  const auto at = [&](double share) {
    for (int p = 0; p < static_cast<int>(block.particles.size()); ++p)
      if (block.surface.radius[p] >= 0 && !(beside(p, rows, share) <= freedom_[p].reach)) return false;
    return true;
  };
  return at(1.0) || at(0.0) || at(share_gone(block, rows));
}

bool BlockPairs::can_go(const DirectBlock& block, Numbers<double>& from, Numbers<double>& to) {
  if (block.surface.empty()) return true;
  for (int p = 0; p < block.movable; ++p)
    if (block.surface.radius[p] >= 0 && !(distance_between(freedom_[p].start, &to[row * p]) <= freedom_[p].limit))
      return false;
  if (!holds(block, from) || !holds(block, to)) follow(block, from, to);
  return !passing(from, to);
}

void BlockPairs::stay(const DirectBlock& block, Numbers<double>& rows) {
  if (!block.surface.empty() && !holds(block, rows)) follow(block, rows, rows);
}

const BlockPair* BlockPairs::passing(Numbers<double>& from, Numbers<double>& to) const {
  for (const BlockPair& pair : pairs_) {
    double x[12], d[12];
    gather(pair, from.data(), x);
    gather(pair, to.data(), d);
    for (int i = 0; i < 12; ++i) d[i] -= x[i];
    if (comes_nearer(pair.key.triangle, x, d, nearest_yet * pair.numbers.touching, 0.0, pair.numbers)) return &pair;
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
