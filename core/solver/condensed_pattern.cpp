#include "core/solver/condensed_pattern.h"

#include <algorithm>
#include <array>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "core/linear/low_fill.h"

namespace sheetbend {
namespace {

using Entries = std::vector<std::pair<int, int>>;

// The constraints' shares of the condensed matrix, whose particles have these first dofs.
CondensedShares shares_of(const Scene& scene, const DirectBlock& block, const std::map<int, int>& particle_of,
                          const std::vector<int>& dof_of) {
  CondensedShares shares;
  for (const Member& m : block.members) {
    const Group& group = scene.groups[m.group];
    shares.members.push_back({m.first_row, group.rows, static_cast<int>(shares.dofs.size()), 0});
    for (const int node : group.nodes(m.item)) {
      if (scene.role[node] != Role::free) continue;
      const int particle = particle_of.at(node);
      shares.gradients.push_back(sheetbend_blocks::row * gradient_row(block, particle, m.first_row));
      shares.dofs.push_back(dof_of[particle]);
      ++shares.members.back().uses;
    }
  }
  for (auto* list : {&shares.gradients, &shares.dofs}) list->shrink_to_fit();
  shares.members.shrink_to_fit();
  return shares;
}

// Bodies with points on a surface that may touch itself: the particles of each.
std::set<std::array<int, 4>> touching_bodies(const DirectBlock& block) {
  std::set<std::array<int, 4>> bodies(block.surface.on_bodies.begin(), block.surface.on_bodies.end());
  std::erase_if(bodies, [&](const auto& body) { return body[0] >= block.movable; });
  return bodies;
}

// The sets of movable particles that a constraint or a point in contact joins.
std::vector<std::vector<int>> joined_particles(const Scene& scene, const DirectBlock& block,
                                               const std::map<int, int>& particle_of) {
  std::vector<std::vector<int>> joined;
  for (const Member& m : block.members) {
    joined.emplace_back();
    for (const int node : scene.groups[m.group].nodes(m.item))
      if (scene.role[node] == Role::free) joined.back().push_back(particle_of.at(node));
  }
  for (const BlockContact& contact : block.contacts)
    if (contact.nodes > 1) joined.emplace_back(contact.particles.begin(), contact.particles.begin() + contact.nodes);
  for (const auto& body : touching_bodies(block)) joined.emplace_back(body.begin(), body.end());
  return joined;
}

// The entries of the lower triangle that constraints and contacts fill.
Entries filled_entries(const DirectBlock& block, const CondensedPattern& c) {
  Entries entries;
  const std::vector<int>& dofs = c.shares.dofs;
  c.shares.for_each_pair([&](const auto&, int i, int k) { add_entries(dofs[i], dofs[k], entries); });
  const auto join = [&](std::span<const int> particles) {
    for (const int p : particles)
      for (const int q : particles)
        if (c.dof_of[q] <= c.dof_of[p]) add_entries(c.dof_of[p], c.dof_of[q], entries);
  };
  for (const BlockContact& contact : block.contacts) join({contact.particles.data(), std::size_t(contact.nodes)});
  for (const auto& body : touching_bodies(block)) join(body);
  return entries;
}

}  // namespace

void add_entries(int row, int column, Entries& entries) {
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      if (column + b <= row + a) entries.emplace_back(row + a, column + b);
}

int gradient_row(const DirectBlock& block, int particle, int row) {
  const auto begin = block.window_rows.begin() + block.window[particle];
  return static_cast<int>(std::lower_bound(begin, block.window_rows.begin() + block.window[particle + 1], row) -
                          block.window_rows.begin());
}

CondensedPattern pattern_of_factor(const Scene& scene, const DirectBlock& block,
                                   const std::map<int, int>& particle_of) {
  CondensedPattern c;
  const std::vector<std::vector<int>> joined = joined_particles(scene, block, particle_of);
  for (const int place : places_for_low_fill(block.movable, joined)) c.dof_of.push_back(3 * place);
  c.dof_of.shrink_to_fit();
  if (!block.surface.empty()) c.joined = joined;
  c.shares = shares_of(scene, block, particle_of, c.dof_of);
  c.structure = FactorStructure(3 * block.movable, filled_entries(block, c), false);
  if (block.implicit) {
    c.shares = {};  // implicit blocks add matrices of their own
    return c;
  }
  const std::vector<int>& dofs = c.shares.dofs;
  c.shares.for_each_pair([&](const auto&, int i, int k) {
    for (int b = 0; b < 3; ++b) {
      const int above = i == k ? b : 0;  // where the lower triangle begins
      c.entries.push_back(c.structure.position(dofs[i] + above, dofs[k] + b) - above);
    }
  });
  c.entries.shrink_to_fit();
  return c;
}

CondensedIteration pattern_of_iteration(const Scene& scene, const DirectBlock& block,
                                        const std::map<int, int>& particle_of, const SolverOptions& options) {
  std::vector<int> dof_of(block.movable);
  for (int p = 0; p < block.movable; ++p) dof_of[p] = 3 * p;
  return {{options.cg_tolerance, options.cg_iterations},
          Aggregation(block.movable, shares_of(scene, block, particle_of, dof_of))};
}

}  // namespace sheetbend
