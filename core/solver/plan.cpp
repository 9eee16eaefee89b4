#include "core/solver/plan.h"

#include <algorithm>
#include <set>
#include <span>
#include <utility>

#include "core/solver/assemblies.h"
#include "core/solver/make_block.h"
#include "core/solver/ordering.h"
#include "core/solver/plan_checks.h"
#include "core/solver/swept_groups.h"

namespace sheetbend {
namespace {

// Makes one set of all members that hold what may touch itself.
void join_what_touches(const Scene& scene, std::vector<std::vector<Member>>& chains) {
  if (scene.self_contact.empty()) return;
  const std::vector<char> touching = touching_itself(scene);
  std::vector<Member>* first = nullptr;
  for (auto& chain : chains) {
    const bool touches = std::ranges::any_of(chain, [&](const Member& m) {
      return std::ranges::any_of(scene.groups[m.group].nodes(m.item),
                                 [&](int n) { return scene.role[n] == Role::free && touching[n]; });
    });
    if (!touches) continue;
    if (first)
      first->insert(first->end(), chain.begin(), chain.end()), chain.clear();
    else
      first = &chain;
  }
  std::erase_if(chains, [](const auto& chain) { return chain.empty(); });
}

// The nodes of points of contacts, and of what touches itself, that no constraint of these holds, and that belong to their block: a free body's center, which its axes' constraint leaves out.
std::vector<int> loose_beside(const Scene& scene, const std::vector<Member>& members) {
  std::set<int> held, loose;
  for (const Member& m : members)
    for (const int n : scene.groups[m.group].nodes(m.item)) held.insert(n);
  const auto look_at = [&](std::span<const int> nodes) {
    if (scene.role[nodes[0]] == Role::free && std::ranges::any_of(nodes, [&](int n) { return held.contains(n); }))
      for (const int n : nodes)
        if (!held.contains(n)) loose.insert(n);
  };
  for (const Contact& contact : scene.contacts)
    for (int i = 0; contact.arity > 1 && i < contact.points(); ++i) look_at(contact.nodes_of(i));
  for (const auto& nodes : scene.self_contact.on_bodies) look_at(nodes);
  return {loose.begin(), loose.end()};
}

// The movable particles of contacts that are in none of these blocks.
std::vector<int> loose_in_contact(const Scene& scene, const std::vector<DirectBlock>& blocks) {
  std::vector<char> known(scene.nodes(), false);
  for (const DirectBlock& block : blocks)
    for (int p = 0; p < block.movable; ++p) known[block.particles[p]] = true;
  std::vector<int> loose;
  for (const Contact& contact : scene.contacts)
    for (const int node : contact.nodes)
      if (scene.role[node] == Role::free && !std::exchange(known[node], true)) loose.push_back(node);
  return loose;
}

}  // namespace

Plan make_plan(const Scene& scene, const SolverOptions& options) {
  check_solver(scene, options);
  Plan plan{options, {}, {}, {}};
  assemble_balls(scene, plan);
  if (options.partition == Partition::gauss_seidel) {
    plan.colors = color_constraints(scene);
    plan.packs = pack_colors(scene, plan.colors);
    plan.contacts = swept_contacts(scene);
    plan.contact_groups = swept_groups(scene, plan.contacts);
    return plan;
  }
  auto chains = connected_chains(scene);
  join_what_touches(scene, chains);
  for (auto& members : chains) {
    const std::vector<int> loose = loose_beside(scene, members);
    plan.blocks.push_back(make_block(scene, std::move(members), options, loose));
  }
  if (const std::vector<int> loose = loose_in_contact(scene, plan.blocks); !loose.empty())
    plan.blocks.push_back(make_block(scene, {}, options, loose));
  return plan;
}

}  // namespace sheetbend
