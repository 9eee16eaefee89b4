#include "core/solver/elimination.h"

#include <algorithm>
#include <map>

#include "core/scalar/pivot.h"
#include "core/solver/body_loops.h"
#include "core/solver/ordering.h"

namespace sheetbend {
namespace {

Elimination number_and_find_structure(const Scene& scene, std::vector<Member>& members, double loop_pivot,
                                      std::span<BlockVolume> volumes) {
  RowsOfNodes rows = number_rows(scene, members, volumes);
  std::vector<std::pair<int, int>> entries;
  for (const auto& [node, uses] : rows) add_entries_of_particle(uses, entries);
  const int count =
      members.back().first_row + scene.groups[members.back().group].rows + static_cast<int>(volumes.size());
  FactorStructure structure(count, entries, volumes.empty() && loop_pivot == 0.0,
                            std::max(loop_pivot, redundant_pivot));
  return {std::move(rows), std::move(structure)};
}

}  // namespace

RowsOfNodes number_rows(const Scene& scene, std::vector<Member>& members, std::span<BlockVolume> volumes) {
  RowsOfNodes rows;
  std::map<int, int> place_of;  // of a node in `rows`
  int next = 0;
  for (Member& m : members) {
    const Group& group = scene.groups[m.group];
    m.first_row = next;
    next += group.rows;
    for (int k = 0; k < group.arity; ++k) {
      const int node = group.nodes(m.item)[k];
      if (scene.role[node] != Role::free) continue;
      const auto [at, is_new] = place_of.emplace(node, static_cast<int>(rows.size()));
      if (is_new) rows.push_back({node, {}});
      for (int row = m.first_row; row < next; ++row) rows[at->second].second.push_back({row, k});
    }
  }
  for (BlockVolume& v : volumes) {
    const std::vector<int>& nodes = scene.volumes[v.volume].nodes;
    v.row = next++;
    for (int k = 0; k < static_cast<int>(nodes.size()); ++k)
      if (scene.role[nodes[k]] == Role::free) rows[place_of.at(nodes[k])].second.push_back({v.row, k});
  }
  return rows;
}

Elimination order_rows(const Scene& scene, std::vector<Member>& members, double loop_pivot,
                       std::span<BlockVolume> volumes) {
  Elimination given = number_and_find_structure(scene, members, loop_pivot, volumes);
  if (given.structure.banded()) return given;
  order_for_low_fill(scene, members);
  if (loop_pivot > 0.0) order_bodies_first(scene, members);
  return number_and_find_structure(scene, members, loop_pivot, volumes);
}

}  // namespace sheetbend
