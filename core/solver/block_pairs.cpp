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

double distance_between(const Vec3<double>& a, const Vec3<double>& b) {
  return std::hypot(a.x - b.x, a.y - b.y, a.z - b.z);
}

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
  const std::size_t spots = block.surface.spots();
  return sizeof(BlockPair) * usual_pairs * (block.surface.edges.size() + block.surface.triangles.size()) +
         (5 * sizeof(double) + sizeof(Vec3<double>)) * spots + Numbers<double>::bytes(row * spots);
}

// The spots stand there, and have no way yet.
void BlockPairs::start_from(const DirectBlock& block, Numbers<double>& rows) {
  const int particles = block.surface.nodes, count = block.surface.spots();
  if (count == particles) {
    origin_ = rows;
  } else {
    origin_.assign(row * count);
    std::copy_n(rows.data(), row * particles, origin_.data());
    for (int p = particles; p < count; ++p) {
      double* to = origin_.data() + row * p;
      at(p, rows.data()).store(to);
      to[3] = spots.inverse_mass(p, [&](int particle) { return rows[row * particle + 3]; });
    }
  }
  reach_.assign(count, 0.0);
  way_.assign(3 * static_cast<std::size_t>(count), 0.0);
}

void BlockPairs::find(const DirectBlock& block, Numbers<double>& from, Numbers<double>& guess,
                      Numbers<double>& target) {
  pairs_.clear();
  if (block.surface.empty()) return;
  start_from(block, from);
  const int count = block.surface.spots();
  start_.assign(count, {});
  limit_.assign(count, 0.0);
  double driven = 0.0;
  for (int p = 0; p < count; ++p) {
    if (!touches_anything(block, p)) continue;
    const Vec3<double> here = at(p, from.data()), free = at(p, guess.data()), forced = at(p, target.data());
    const bool moves = can_move(block, p);
    const double far = std::max(distance_between(here, forced), moves ? distance_between(here, free) : 0.0);
    start_[p] = here;
    limit_[p] = reach_[p] = margin * radius[p];
    if (!std::isfinite(far)) continue;
    limit_[p] += far;
    reach_[p] += moves ? distance_between(free, forced) : far;  // a fixed one does not go with the others
    if (moves)
      (free - here).store(&way_[3 * static_cast<std::size_t>(p)]);
    else
      driven = std::max(driven, limit_[p]);
  }
  for (int p = 0; p < count; ++p) limit_[p] = farthest * (limit_[p] + driven + radius[p]);
  search(block);
}

void BlockPairs::find_at(const DirectBlock& block, Numbers<double>& rows) {
  pairs_.clear();
  if (block.surface.empty()) return;
  start_from(block, rows);
  search(block);
}

void BlockPairs::search(const DirectBlock& block) {
  pairs_.clear();
  for (const PairKey& key :
       find_pairs(block.surface, {origin_.data(), row, radius.data(), reach_.data(), way_.data()})) {
    BlockPair pair{key, spots_of(block.surface, key), {}};
    double w[4], sum = 0.0;
    for (int k = 0; k < 4; ++k) sum += w[k] = can_move(block, pair.spots[k]) ? origin_[row * pair.spots[k] + 3] : 0.0;
    if (!(sum > 0.0)) continue;  // nothing of it moves
    const int second = pair.spots[key.triangle ? 1 : 2];
    pair.numbers = pair_numbers(key.triangle, radius[pair.spots[0]], radius[second], w, stiffness);
    pairs_.push_back(pair);
  }
}

// For the way from one state to another.
void BlockPairs::follow(const DirectBlock& block, Numbers<double>& from, Numbers<double>& to) {
  start_from(block, from);
  for (int p = 0; p < block.surface.spots(); ++p) {
    reach_[p] = margin * radius[p];
    (at(p, to.data()) - at(p, from.data())).store(&way_[3 * static_cast<std::size_t>(p)]);
  }
  search(block);
}

// How far a spot is from that share of its way.
double BlockPairs::beside(int spot, Numbers<double>& rows, double share) {
  const Vec3<double> there = Vec3<double>(&origin_[row * spot]) + share * way(spot);
  return distance_between(there, at(spot, rows.data()));
}

// The share of their ways that most spots have gone: all of it, unless a step was shortened.
double BlockPairs::share_gone(const DirectBlock& block, Numbers<double>& rows) {
  std::vector<std::pair<double, double>> shares;  // of each spot, with how long its way is
  for (int p = 0; p < block.surface.spots(); ++p) {
    if (!touches_anything(block, p) || !can_move(block, p)) continue;
    const Vec3<double> whole = way(p), gone = at(p, rows.data()) - Vec3<double>(&origin_[row * p]);
    if (const double squared = dot(whole, whole); squared > 0.0)
      shares.emplace_back(dot(whole, gone) / squared, std::sqrt(squared));
  }
  return std::clamp(median(shares), 0.0, 1.0);
}

// Whether the list has all pairs that touch there.
bool BlockPairs::holds(const DirectBlock& block, Numbers<double>& rows) {
  const auto all_at = [&](double share) {
    for (int p = 0; p < block.surface.spots(); ++p)
      if (touches_anything(block, p) && !(beside(p, rows, share) <= reach_[p])) return false;
    return true;
  };
  return all_at(1.0) || all_at(0.0) || all_at(share_gone(block, rows));
}

bool BlockPairs::can_go(const DirectBlock& block, Numbers<double>& from, Numbers<double>& to) {
  if (block.surface.empty()) return true;
  for (int p = 0; p < block.surface.spots(); ++p)
    if (touches_anything(block, p) && can_move(block, p) &&
        !(distance_between(start_[p], at(p, to.data())) <= limit_[p]))
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
