#include "core/solver/assemblies.h"

#include <algorithm>
#include <map>

#include "core/scalar/pivot.h"
#include "core/solver/body_loops.h"
#include "core/solver/ordering.h"

namespace sheetbend {
namespace {

bool pushes_in_impacts(const Scene& scene, const Member& m) {
  const Group& group = scene.groups[m.group];
  return !group.unilateral && std::ranges::none_of(group.nodes(m.item), [&](int n) { return scene.is_director[n]; });
}

// Numbers the rows, and finds who uses them and which meet.
Assembly assembled(const Scene& scene, std::vector<Member> members, double loop_pivot) {
  std::map<int, std::vector<Assembly::Use>> uses;
  int rows = 0;
  for (int i = 0; i < static_cast<int>(members.size()); ++i) {
    const Group& group = scene.groups[members[i].group];
    members[i].first_row = rows;
    rows += group.rows;
    for (int k = 0; k < group.arity; ++k)
      if (const int n = group.nodes(members[i].item)[k]; scene.role[n] == Role::free) uses[n].push_back({i, k});
  }
  std::vector<std::pair<int, int>> entries;
  for (const auto& [node, own] : uses)
    for (const auto& one : own)
      for (const auto& other : own)
        for (int j = 0; j < scene.groups[members[one.member].group].rows; ++j)
          for (int k = 0; k < scene.groups[members[other.member].group].rows; ++k)
            if (const int row = members[one.member].first_row + j, column = members[other.member].first_row + k;
                column <= row)
              entries.emplace_back(row, column);
  const FactorStructure structure(rows, entries, loop_pivot == 0.0, std::max(loop_pivot, redundant_pivot));
  return {std::move(members), structure, {uses.begin(), uses.end()}};
}

}  // namespace

void assemble_balls(const Scene& scene, Plan& plan) {
  plan.assembly_of_ball.assign(scene.balls.members.size(), -1);
  if (std::ranges::none_of(scene.balls.held, [](char held) { return held; })) return;
  std::map<int, int> ball_of;  // by node
  for (int b = 0; b < static_cast<int>(scene.balls.members.size()); ++b) ball_of[scene.balls.members[b].node] = b;
  for (std::vector<Member>& members : connected_chains(scene)) {
    std::erase_if(members, [&](const Member& m) { return !pushes_in_impacts(scene, m); });
    const int own = static_cast<int>(plan.assemblies.size());
    bool any = false;
    for (const Member& m : members)
      for (const int n : scene.groups[m.group].nodes(m.item))
        if (const auto at = ball_of.find(n); at != ball_of.end()) plan.assembly_of_ball[at->second] = own, any = true;
    if (!any) continue;
    const double loop_pivot = closes_loop(scene, members) ? pivot_of_loop : 0.0;
    Assembly assembly = assembled(scene, members, loop_pivot);
    if (!assembly.structure.banded()) {
      order_for_low_fill(scene, members);
      if (loop_pivot > 0.0) order_bodies_first(scene, members);
      assembly = assembled(scene, std::move(members), loop_pivot);
    }
    plan.assemblies.push_back(std::move(assembly));
  }
}

}  // namespace sheetbend
