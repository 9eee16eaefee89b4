#include "core/solver/assemblies.h"

#include <algorithm>
#include <map>

#include "core/solver/body_loops.h"
#include "core/solver/elimination.h"
#include "core/solver/ordering.h"

namespace sheetbend {
namespace {

bool pushes_in_impacts(const Scene& scene, const Member& m) {
  const Group& group = scene.groups[m.group];
  return !group.unilateral && std::ranges::none_of(group.nodes(m.item), [&](int n) { return scene.is_director[n]; });
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
    Elimination elimination = order_rows(scene, members, loop_pivot);
    std::ranges::sort(elimination.rows, {}, &RowsOfNodes::value_type::first);
    plan.assemblies.push_back({std::move(members), std::move(elimination.structure), std::move(elimination.rows)});
  }
}

}  // namespace sheetbend
