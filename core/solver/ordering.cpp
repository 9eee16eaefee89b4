#include "core/solver/ordering.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "core/linear/low_fill.h"

namespace sheetbend {
namespace {

template <class F>
void for_each_constraint(const Scene& scene, F&& f) {
  for (int g = 0; g < static_cast<int>(scene.groups.size()); ++g)
    for (int i = 0; i < scene.groups[g].count; ++i) f(g, i, scene.groups[g].nodes(i));
}

bool movable(const Scene& scene, int node) { return scene.role[node] == Role::free; }

std::vector<std::vector<int>> movable_neighbors(const Scene& scene) {
  std::vector<std::vector<int>> neighbors(scene.nodes());
  const auto join = [&](std::span<const int> nodes) {
    for (const int a : nodes)
      for (const int b : nodes)
        if (a != b && movable(scene, a) && movable(scene, b)) neighbors[a].push_back(b);
  };
  for_each_constraint(scene, [&](int, int, std::span<const int> nodes) { join(nodes); });
  for (const Contact& contact : scene.contacts)  // a point needs all its nodes in one block
    for (int i = 0; contact.arity > 1 && i < contact.points(); ++i) join(contact.nodes_of(i));
  for (auto& list : neighbors) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return neighbors;
}

// Cuthill-McKee from `start`: breadth first, neighbors by degree, then by number.
std::vector<int> cuthill_mckee(const std::vector<std::vector<int>>& neighbors, int start) {
  std::vector<int> order{start};
  std::vector<char> seen(neighbors.size(), 0);
  seen[start] = 1;
  for (std::size_t head = 0; head < order.size(); ++head) {
    std::vector<int> next;
    for (const int b : neighbors[order[head]])
      if (!seen[b]) next.push_back(b), seen[b] = 1;
    std::stable_sort(next.begin(), next.end(), [&](int a, int b) { return neighbors[a].size() < neighbors[b].size(); });
    order.insert(order.end(), next.begin(), next.end());
  }
  return order;
}

// A kept volume makes one component of all that it touches: the lowest.
void join_by_volumes(const Scene& scene, std::vector<int>& component) {
  for (bool changed = true; changed;) {
    changed = false;
    for (const Volume& volume : scene.volumes) {
      std::set<int> touched;
      for (const int n : volume.nodes)
        if (movable(scene, n)) touched.insert(component[n]);
      if (touched.size() < 2) continue;
      changed = true;
      for (int& c : component)
        if (touched.contains(c)) c = *touched.begin();
    }
  }
}

struct Keyed {
  double place;
  Member member;
};

}  // namespace

std::vector<Color> color_constraints(const Scene& scene) {
  std::vector<Color> colors;
  for (int g = 0; g < static_cast<int>(scene.groups.size()); ++g) {
    const Group& group = scene.groups[g];
    const std::size_t first = colors.size();
    std::vector<std::vector<char>> taken;  // per color of this group: movable nodes already used
    for (int i = 0; i < group.count; ++i) {
      const auto nodes = group.nodes(i);
      const auto clashes = [&](std::size_t c) {
        return std::any_of(nodes.begin(), nodes.end(), [&](int n) { return movable(scene, n) && taken[c][n]; });
      };
      std::size_t c = 0;
      while (c < taken.size() && clashes(c)) ++c;
      if (c == taken.size()) {
        taken.emplace_back(scene.nodes(), 0);
        colors.push_back({g, {}});
      }
      for (const int n : nodes) taken[c][n] = 1;
      colors[first + c].items.push_back(i);
    }
  }
  // In the order of their particles, which is that of memory: constraints of one color do not see one another, so it changes no result.
  for (Color& color : colors) {
    const auto lowest = [&](int i) { return *std::ranges::min_element(scene.groups[color.group].nodes(i)); };
    std::ranges::stable_sort(color.items, {}, lowest);
    color.items.shrink_to_fit();
  }
  return colors;
}

std::vector<std::vector<Member>> connected_chains(const Scene& scene) {
  const auto neighbors = movable_neighbors(scene);
  std::vector<int> component(scene.nodes(), -1), rank(scene.nodes(), -1);
  int components = 0;
  for (int n = 0; n < scene.nodes(); ++n) {
    if (!movable(scene, n) || component[n] >= 0) continue;
    // The last node of a breadth-first walk lies at an end; walking again from there numbers the chain along its length.
    const auto order = cuthill_mckee(neighbors, cuthill_mckee(neighbors, n).back());
    for (std::size_t k = 0; k < order.size(); ++k) {
      component[order[k]] = components;
      rank[order[k]] = static_cast<int>(k);
    }
    ++components;
  }
  join_by_volumes(scene, component);
  // Constraints go by the mean place of their nodes, nodes by that of their constraints, from the ranks on: so links and joints of a rope
  // alternate also at its ends, where whole ranks would widen the band.
  std::vector<double> place(rank.begin(), rank.end());
  std::vector<std::vector<Keyed>> keyed;
  for (int round = 0; round < 4; ++round) {
    keyed.assign(components, {});
    std::vector<double> sum(scene.nodes(), 0.0), uses(scene.nodes(), 0.0);
    for_each_constraint(scene, [&](int g, int i, std::span<const int> nodes) {
      double total = 0.0, count = 0.0;
      int home = -1;
      for (const int n : nodes)
        if (movable(scene, n)) total += place[n], ++count, home = component[n];
      keyed[home].push_back({total / count, {g, i, 0}});
      for (const int n : nodes) sum[n] += total / count, ++uses[n];
    });
    for (int n = 0; n < scene.nodes(); ++n)
      if (uses[n] > 0.0) place[n] = sum[n] / uses[n];
  }
  std::vector<std::vector<Member>> chains;
  for (auto& list : keyed) {
    if (list.empty()) continue;
    std::stable_sort(list.begin(), list.end(), [](const Keyed& a, const Keyed& b) { return a.place < b.place; });
    chains.emplace_back();
    for (const Keyed& k : list) chains.back().push_back(k.member);
  }
  return chains;
}

void order_for_low_fill(const Scene& scene, std::vector<Member>& members) {
  std::map<int, std::vector<int>> users;
  for (int m = 0; m < static_cast<int>(members.size()); ++m)
    for (const int n : scene.groups[members[m].group].nodes(members[m].item))
      if (movable(scene, n)) users[n].push_back(m);
  std::vector<std::vector<int>> joined;
  for (auto& [node, list] : users) joined.push_back(std::move(list));
  const std::vector<int> place = places_for_low_fill(static_cast<int>(members.size()), joined);
  std::vector<Member> ordered(members.size());
  for (std::size_t i = 0; i < members.size(); ++i) ordered[place[i]] = members[i];
  members = std::move(ordered);
}

}  // namespace sheetbend
