#include "core/solver/plan.h"

#include <cmath>
#include <map>
#include <stdexcept>
#include <string>

#include "core/solver/ordering.h"

namespace sheetbend {
namespace {

// Numbers the members' rows and lists every pair of members that shares a movable node.
struct Couplings {
  std::vector<Coupling> list;
  std::vector<std::pair<int, int>> entries;
  int rows = 0;
};

Couplings couple(const Scene& scene, std::vector<Member>& members) {
  Couplings c;
  std::map<int, std::vector<std::pair<int, int>>> users;  // node -> (member, slot)
  for (int m = 0; m < static_cast<int>(members.size()); ++m) {
    const Group& group = scene.groups[members[m].group];
    members[m].first_row = c.rows;
    c.rows += group.rows;
    const auto nodes = group.nodes(members[m].item);
    for (int slot = 0; slot < group.arity; ++slot)
      if (scene.role[nodes[slot]] == Role::free) users[nodes[slot]].push_back({m, slot});
  }
  for (const auto& [node, list] : users)
    for (const auto& [row, row_slot] : list)
      for (const auto& [column, column_slot] : list) {
        if (column > row) continue;
        c.list.push_back({row, column, node, row_slot, column_slot, 0});
        const int r = scene.groups[members[row].group].rows, k = scene.groups[members[column].group].rows;
        for (int i = 0; i < r; ++i)
          for (int j = 0; j < k; ++j)
            if (members[row].first_row + i >= members[column].first_row + j)
              c.entries.emplace_back(members[row].first_row + i, members[column].first_row + j);
      }
  return c;
}

DirectBlock make_block(const Scene& scene, std::vector<Member> members) {
  Couplings couplings = couple(scene, members);
  FactorStructure structure(couplings.rows, couplings.entries);
  if (!structure.banded()) {
    order_for_low_fill(scene, members);
    couplings = couple(scene, members);
    structure = FactorStructure(couplings.rows, couplings.entries);
  }
  DirectBlock block{std::move(members), {}, 0, std::move(couplings.list), {}, std::move(structure)};
  for (Coupling& c : block.couplings) {
    const Member &row = block.members[c.row_member], &column = block.members[c.column_member];
    c.first_position = static_cast<int>(block.position.size());
    for (int i = 0; i < scene.groups[row.group].rows; ++i)
      for (int j = 0; j < scene.groups[column.group].rows; ++j) {
        const int r = row.first_row + i, k = column.first_row + j;
        block.position.push_back(r >= k ? static_cast<int>(block.structure.position(r, k)) : -1);
      }
  }
  std::vector<char> seen(scene.nodes(), 0);
  for (const Coupling& c : block.couplings)
    if (!seen[c.node]) seen[c.node] = 1, block.nodes.push_back(c.node);
  return block;
}

void check(const SolverOptions& o) {
  if (!(o.h > 0.0) || !std::isfinite(o.h))
    throw std::invalid_argument("h: the substep is " + std::to_string(o.h) + " s. Fix: give a positive time");
  if (o.iterations < 1)
    throw std::invalid_argument("iterations: got " + std::to_string(o.iterations) + ". Fix: give at least 1");
  if (o.threads < 1)
    throw std::invalid_argument("threads: got " + std::to_string(o.threads) + ". Fix: give at least 1");
}

}  // namespace

Plan make_plan(const Scene& scene, const SolverOptions& options) {
  check(options);
  Plan plan{options, {}, {}, {}};
  if (options.partition == Partition::gauss_seidel) {
    plan.colors = color_constraints(scene);
    plan.packs = pack_colors(scene, plan.colors);
  } else
    for (auto& members : connected_chains(scene)) {
      const int first_row =
          plan.blocks.empty() ? 0 : plan.blocks.back().first_row + plan.blocks.back().structure.size();
      plan.blocks.push_back(make_block(scene, std::move(members)));
      plan.blocks.back().first_row = first_row;
    }
  return plan;
}

}  // namespace sheetbend
