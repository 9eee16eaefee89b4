#include "core/linear/aggregation.h"

#include <algorithm>
#include <utility>

#include "core/linear/low_fill.h"

namespace sheetbend {
namespace {

struct Coupling {
  int other, constraints;
};

// Neighbors that share at least half as many constraints with a particle as its closest one, seen from either side: of a mesh those along its
// edges, not those across.
std::vector<std::vector<int>> close_neighbors(const Aggregation& a, const std::vector<int>& shared) {
  const int particles = static_cast<int>(a.start.size()) - 1;
  std::vector<int> closest(particles, 0);
  const auto for_each_coupling = [&](auto&& f) {
    for (int i = 0; i < particles; ++i)
      for (int k = a.start[i]; k < a.start[i + 1] - 1; ++k) f(i, a.column[k], shared[k]);
  };
  for_each_coupling([&](int i, int j, int constraints) {
    for (const int p : {i, j}) closest[p] = std::max(closest[p], constraints);
  });
  std::vector<std::vector<int>> close(particles);
  for_each_coupling([&](int i, int j, int constraints) {
    if (2 * constraints < std::min(closest[i], closest[j])) return;
    close[i].push_back(j);
    close[j].push_back(i);
  });
  return close;
}

// A particle none of whose neighbors is taken makes an aggregate with them; who is left joins a neighbor's. Gives each particle's, and their number.
std::pair<std::vector<int>, int> aggregate(const std::vector<std::vector<int>>& close) {
  const int particles = static_cast<int>(close.size());
  std::vector<int> first(particles, -1);
  int count = 0;
  for (int i = 0; i < particles; ++i) {
    if (first[i] >= 0 || std::ranges::any_of(close[i], [&](int j) { return first[j] >= 0; })) continue;
    first[i] = count;
    for (const int j : close[i]) first[j] = count;
    ++count;
  }
  std::vector<int> all = first;
  for (int i = 0; i < particles; ++i)
    if (all[i] < 0) all[i] = first[*std::ranges::find_if(close[i], [&](int j) { return first[j] >= 0; })];
  return {std::move(all), count};
}

}  // namespace

Aggregation::Aggregation(int particles, CondensedShares shares_) : shares(std::move(shares_)) {
  const std::vector<int> shared = find_couplings(particles);
  const auto [of, count] = aggregate(close_neighbors(*this, shared));
  find_coarse(of, count);
}

std::vector<int> Aggregation::find_couplings(int particles) {
  std::vector<std::vector<int>> with(particles);
  shares.for_each_pair([&](const auto&, int i, int k) { with[shares.dofs[i] / 3].push_back(shares.dofs[k] / 3); });
  std::vector<int> shared;
  for (auto& others : with) {
    std::ranges::sort(others);
    for (auto from = others.begin(); from != others.end();) {
      const auto to = std::upper_bound(from, others.end(), *from);
      column.push_back(*from);
      shared.push_back(static_cast<int>(to - from));
      from = to;
    }
    start.push_back(static_cast<int>(column.size()));
  }
  shares.for_each_pair([&](const auto&, int i, int k) {
    const auto row = column.begin() + start[shares.dofs[i] / 3], end = column.begin() + start[shares.dofs[i] / 3 + 1];
    entry.push_back(static_cast<int>(std::lower_bound(row, end, shares.dofs[k] / 3) - column.begin()));
  });
  for (auto* list : {&column, &entry}) list->shrink_to_fit();
  return shared;
}

void Aggregation::find_coarse(const std::vector<int>& aggregate, int count) {
  const int particles = static_cast<int>(aggregate.size());
  std::vector<std::vector<int>> joined;
  for (int i = 0; i < particles; ++i)
    for (int k = start[i]; k < start[i + 1]; ++k)
      if (aggregate[column[k]] != aggregate[i]) joined.push_back({aggregate[i], aggregate[column[k]]});
  const std::vector<int> place = places_for_low_fill(count, joined);
  for (const int a : aggregate) dof_of.push_back(modes * place[a]);

  std::vector<std::pair<int, int>> blocks;  // first dofs of rows and columns
  const auto block_of = [&](int i, int j) {
    return std::pair(std::max(dof_of[i], dof_of[j]), std::min(dof_of[i], dof_of[j]));
  };
  for (int i = 0; i < particles; ++i)
    for (int k = start[i]; k < start[i + 1]; ++k) blocks.push_back(block_of(i, column[k]));
  std::ranges::sort(blocks);
  blocks.erase(std::ranges::unique(blocks).begin(), blocks.end());
  for (int i = 0; i < particles; ++i)
    for (int k = start[i]; k < start[i + 1]; ++k)
      coarse_entry.push_back(
          static_cast<int>(std::ranges::lower_bound(blocks, block_of(i, column[k])) - blocks.begin()));

  std::vector<std::pair<int, int>> entries;
  for (const auto& [row, column] : blocks)
    for (int a = 0; a < modes; ++a)
      for (int b = 0; b < modes; ++b)
        if (column + b <= row + a) entries.emplace_back(row + a, column + b);
  coarse = FactorStructure(modes * count, entries, false);
  for (const auto& [row, column] : blocks)
    for (int b = 0; b < modes; ++b) {
      const int above = row == column ? b : 0;  // where the lower triangle begins
      coarse_column.push_back(coarse.position(row + above, column + b) - above);
    }
}

std::size_t Aggregation::bytes() const {
  const std::size_t ints = start.size() + column.size() + entry.size() + dof_of.size() + coarse_entry.size();
  return shares.bytes() + coarse.bytes() + sizeof(int) * ints + sizeof(std::size_t) * coarse_column.size();
}

}  // namespace sheetbend
