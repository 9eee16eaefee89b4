#include "core/solver/make_block.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "core/solver/block_frames.h"
#include "core/solver/body_loops.h"
#include "core/solver/condensed_pattern.h"
#include "core/solver/elimination.h"
#include "core/solver/paired_pattern.h"

namespace sheetbend {
namespace {

using sheetbend_blocks::lanes;

// The volumes around the members' nodes; connected_chains() has left none of their nodes to other members.
std::vector<BlockVolume> volumes_around(const Scene& scene, const std::vector<Member>& members) {
  if (scene.volumes.empty()) return {};
  std::set<int> nodes;
  for (const Member& m : members)
    for (const int node : scene.groups[m.group].nodes(m.item))
      if (scene.role[node] == Role::free) nodes.insert(node);
  std::vector<BlockVolume> volumes;
  for (int v = 0; v < static_cast<int>(scene.volumes.size()); ++v)
    if (std::ranges::any_of(scene.volumes[v].nodes, [&](int node) { return nodes.contains(node); }))
      volumes.push_back({v, 0, {}, {}});
  return volumes;
}

// A particle of the block, with the rows that it takes part in. Windows of a band have no gaps: rows between that do not touch the particle
// have a gradient of zero.
int add_particle(DirectBlock& block, int node, const std::vector<int>& rows) {
  block.particles.push_back(node);
  if (block.banded())
    for (int row = rows.front(); row <= rows.back(); ++row) block.window_rows.push_back(row);
  else
    block.window_rows.insert(block.window_rows.end(), rows.begin(), rows.end());
  block.window.push_back(static_cast<int>(block.window_rows.size()));
  return static_cast<int>(block.particles.size()) - 1;
}

MemberRun make_run(const Scene& scene, int g, const std::map<int, int>& particle_of, DirectBlock& block) {
  const Group& group = scene.groups[g];
  MemberRun run{g, 0, {}, {}, {}, {}};
  std::vector<Member> own;
  for (const Member& m : block.members)
    if (m.group == g) own.push_back(m);
  run.count = static_cast<int>(own.size());
  const int width = (run.count + lanes - 1) / lanes * lanes;
  run.nodes.resize(static_cast<std::size_t>(width) * group.arity);
  run.gradients.resize(run.nodes.size());
  for (int i = 0; i < width; ++i) {
    const Member& m = own[std::min(i, run.count - 1)];
    run.items.push_back(m.item);
    run.first_row.push_back(m.first_row);
    for (int k = 0; k < group.arity; ++k) {
      const long at = lane_at(i, group.arity, k);
      if (i >= run.count) {
        run.nodes[at] = run.nodes[lane_at(run.count - 1, group.arity, k)];
        run.gradients[at] = run.gradients[lane_at(run.count - 1, group.arity, k)];
        continue;
      }
      const int node = group.nodes(m.item)[k];
      std::vector<int> rows(group.rows);
      std::iota(rows.begin(), rows.end(), m.first_row);
      const int particle = scene.role[node] == Role::free ? particle_of.at(node) : add_particle(block, node, rows);
      run.nodes[at] = sheetbend_blocks::row * particle;
      run.gradients[at] = sheetbend_blocks::row * gradient_row(block, particle, m.first_row);
    }
  }
  return run;
}

void add_volumes(const Scene& scene, const std::map<int, int>& particle_of, DirectBlock& block) {
  for (BlockVolume& v : block.volumes) {
    for (const int node : scene.volumes[v.volume].nodes) {
      v.particles.push_back(scene.role[node] == Role::free ? particle_of.at(node) : add_particle(block, node, {v.row}));
      v.gradients.push_back(gradient_row(block, v.particles.back(), v.row));
    }
    block.multipliers.push_back(scene.rows + v.volume);
  }
}

// The contacts of points that the block's movable particles carry.
std::vector<BlockContact> contacts_of(const Scene& scene, const std::map<int, int>& particle_of) {
  std::vector<BlockContact> contacts;
  for (int c = 0; c < static_cast<int>(scene.contacts.size()); ++c) {
    const Contact& contact = scene.contacts[c];
    for (int i = 0; i < contact.points(); ++i) {
      if (!particle_of.contains(contact.first_node(i))) continue;
      BlockContact own{c, i, contact.collider, scene.colliders[contact.collider].any(), contact.arity, {}};
      for (int k = 0; k < contact.arity; ++k) own.particles[k] = particle_of.at(contact.nodes_of(i)[k]);
      contacts.push_back(own);
    }
  }
  std::stable_sort(contacts.begin(), contacts.end(),
                   [](const BlockContact& a, const BlockContact& b) { return a.particles[0] < b.particles[0]; });
  return contacts;
}

// What may touch itself, in a block that has all of it. Fixed nodes are particles of the block that no row knows.
SelfContact surface_of(const Scene& scene, const std::map<int, int>& particle_of, DirectBlock& block) {
  const SelfContact& whole = scene.self_contact;
  if (whole.empty()) return {};
  const std::vector<char> touching = touching_itself(scene);
  if (std::ranges::none_of(particle_of, [&](const auto& at) { return touching[at.first]; })) return {};
  std::vector<int> place(whole.spots(), -1);
  SelfContact s = whole;
  for (int n = 0; n < scene.nodes(); ++n)
    if (touching[n]) place[n] = scene.role[n] == Role::free ? particle_of.at(n) : add_particle(block, n, {});
  s.nodes = static_cast<int>(block.particles.size());
  for (int n = scene.nodes(); n < whole.spots(); ++n) place[n] = s.nodes + n - whole.nodes;
  for (auto& edge : s.edges)
    for (int& n : edge) n = place[n];
  for (auto& corners : s.triangles)
    for (int& n : corners) n = place[n];
  for (int& n : s.points) n = place[n];
  for (auto& nodes : s.on_bodies)
    for (int& n : nodes) n = place[n];
  s.radius.assign(s.spots(), -1);
  for (int n = 0; n < whole.spots(); ++n)
    if (place[n] >= 0) s.radius[place[n]] = whole.radius[n];
  return s;
}

}  // namespace

std::vector<char> touching_itself(const Scene& scene) {
  const SelfContact& s = scene.self_contact;
  std::vector<char> touching(scene.nodes(), false);
  for (int n = 0; !s.empty() && n < scene.nodes(); ++n) touching[n] = s.radius[n] >= 0;
  for (const auto& nodes : s.on_bodies)
    for (const int n : nodes) touching[n] = true;
  return touching;
}

DirectBlock make_block(const Scene& scene, std::vector<Member> members, const SolverOptions& options,
                       const std::vector<int>& loose) {
  const bool condensed = options.partition != Partition::direct;
  const double loop_pivot = closes_loop(scene, members) ? pivot_of_loop : 0.0;
  if (condensed && loop_pivot > 0.0) order_bodies_first(scene, members);
  std::vector<BlockVolume> volumes = volumes_around(scene, members);
  Elimination elimination = condensed ? Elimination{number_rows(scene, members, volumes), FactorStructure(0, {})}
                                      : order_rows(scene, members, loop_pivot, volumes);
  for (const int node : loose) elimination.rows.push_back({node, {}});
  DirectBlock block{std::move(members), {}, {}, {0}, {}, {}, {}, 0, false, false, std::move(elimination.structure)};
  block.volumes = std::move(volumes);
  block.implicit = options.partition == Partition::implicit;
  block.loop_pivot = loop_pivot;
  if (condensed) block.condensation.emplace();  // to be filled in: it has no band
  std::map<int, int> particle_of;
  for (const auto& [node, uses] : elimination.rows) {
    std::vector<int> rows;
    for (const RowUse& use : uses) rows.push_back(use.row);
    particle_of[node] = add_particle(block, node, rows);
    if (!condensed && !block.banded())
      for (const int row : rows)
        for (const int column : rows)
          if (column <= row) block.positions.push_back(block.structure.position(row, column));
  }
  block.movable = static_cast<int>(block.particles.size());
  std::set<int> groups;
  for (const Member& m : block.members) {
    const Group& group = scene.groups[m.group];
    groups.insert(m.group);
    block.damped |= group.damped;
    for (int j = 0; j < group.rows; ++j) block.multipliers.push_back(group.first_row + m.item * group.rows + j);
  }
  for (const int g : groups) block.runs.push_back(make_run(scene, g, particle_of, block));
  add_volumes(scene, particle_of, block);
  block.contacts = contacts_of(scene, particle_of);
  block.surface = surface_of(scene, particle_of, block);
  if (options.partition == Partition::newton || block.implicit)
    block.condensation = pattern_of_factor(scene, block, particle_of);
  if (block.implicit) block.frames = frames_of_block(scene, block);
  if (block.implicit)
    for (MemberRun& run : block.runs)
      run.entries = entries_of(scene, block, run, std::get<CondensedPattern>(*block.condensation));
  if (options.partition == Partition::newton_cg)
    block.condensation = pattern_of_iteration(scene, block, particle_of, options);
  return block;
}

}  // namespace sheetbend
