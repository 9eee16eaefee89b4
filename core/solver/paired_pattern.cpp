#include "core/solver/paired_pattern.h"

#include <algorithm>

#include "core/linear/low_fill.h"
#include "core/solver/condensed_pattern.h"

namespace sheetbend {
namespace {

// The movable particles of a pair, each once.
std::vector<int> particles_of(const DirectBlock& block, const PairKey& pair) {
  const SelfContact& s = block.surface;
  std::vector<int> particles;
  const auto add = [&](int p) {
    if (p < block.movable && std::ranges::find(particles, p) == particles.end()) particles.push_back(p);
  };
  for (const int spot : spots_of(s, pair)) {
    if (spot < s.nodes)
      add(spot);
    else
      std::ranges::for_each(s.on_bodies[spot - s.nodes], add);
  }
  return particles;
}

}  // namespace

std::vector<int> entries_of(const Scene& scene, const DirectBlock& block, const MemberRun& run,
                            const CondensedPattern& pattern) {
  const int arity = scene.groups[run.group].arity, dofs = 3 * arity;
  std::vector<int> entries(run.items.size() * triangle(dofs), -1);
  for (int i = 0; i < run.count; ++i) {
    const auto dof = [&](int d) {
      const int particle = run.nodes[lane_at(i, arity, d / 3)] / sheetbend_blocks::row;
      return particle < block.movable ? pattern.dof_of[particle] + d % 3 : -1;
    };
    for (int a = 0; a < dofs; ++a)
      for (int b = 0; b <= a; ++b)
        if (const auto [column, row] = std::minmax({dof(a), dof(b)}); column >= 0)
          entries[lane_at(i, triangle(dofs), triangle(a) + b)] =
              static_cast<int>(pattern.structure.position(row, column));
  }
  return entries;
}

PairedPattern pattern_with(const Scene& scene, const DirectBlock& block, const std::vector<PairKey>& pairs) {
  std::vector<std::vector<int>> joined = std::get<CondensedPattern>(*block.condensation).joined;
  for (const PairKey& pair : pairs) joined.push_back(particles_of(block, pair));
  PairedPattern all;
  CondensedPattern& c = all.pattern;
  for (const int place : places_for_low_fill(block.movable, joined)) c.dof_of.push_back(3 * place);
  std::vector<std::pair<int, int>> places;  // first dofs of two particles, (row, column)
  for (const auto& own : joined)
    for (const int p : own)
      for (const int q : own)
        if (c.dof_of[q] <= c.dof_of[p]) places.emplace_back(c.dof_of[p], c.dof_of[q]);
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  std::vector<std::pair<int, int>> entries;
  for (const auto& [row, column] : places) add_entries(row, column, entries);
  c.structure = FactorStructure(3 * block.movable, entries, false);
  for (const MemberRun& run : block.runs) all.entries.push_back(entries_of(scene, block, run, c));
  return all;
}

}  // namespace sheetbend
