#include "core/solver/body_loops.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <tuple>

#include "core/constraints/rigid.h"

namespace sheetbend {
namespace {

// Rows between points of the same two bodies, of one group: so many keep a point on a line, and a point in a place.
constexpr int rows_of_line = 2, rows_of_point = 3;

}  // namespace

bool closes_loop(const Scene& scene, const std::vector<Member>& members) {
  std::map<int, int> body_of;  // by its center
  for (int b = 0; b < static_cast<int>(scene.bodies.size()); ++b) body_of[scene.bodies[b].center] = b;
  const int ground = static_cast<int>(scene.bodies.size());
  std::vector<int> joined(ground + 1);
  std::iota(joined.begin(), joined.end(), 0);
  const auto root = [&](int b) {
    while (joined[b] != b) b = joined[b];
    return b;
  };
  const auto is_held = [&](int node) { return scene.role[node] != Role::free; };
  for (int b = 0; b < ground; ++b)
    if (is_held(scene.bodies[b].center)) joined[b] = ground;
  std::map<std::tuple<int, int, int>, int> rows_between;  // of a group, two bodies
  for (const Member& m : members) {
    const Group& group = scene.groups[m.group];
    if (group.points != 2) continue;
    const auto end = [&](int k) {
      const int node = group.nodes(m.item)[k];
      const auto found = body_of.find(node);
      if (found == body_of.end()) return is_held(node) ? ground : -1;
      return std::ranges::all_of(scene.bodies[found->second].axes, is_held) ? ground : found->second;
    };
    const auto [first, second] = std::minmax({end(0), end(1)});
    if (first < 0 || first == ground) continue;  // a particle, such as a pinned mean; or nothing moves
    int& rows = rows_between[{m.group, first, second}];
    const bool were_joined = rows >= rows_of_line;
    rows += group.rows;
    if (rows > rows_of_point) return true;  // more than one joint
    if (were_joined || rows < rows_of_line) continue;
    const int a = root(first), b = root(second);
    if (a == b) return true;
    joined[a] = b;
  }
  return false;
}

void order_bodies_first(const Scene& scene, std::vector<Member>& members) {
  const int rigid = kind_of(Rigid::name);
  std::ranges::stable_partition(members, [&](const Member& m) { return scene.groups[m.group].kind == rigid; });
}

}  // namespace sheetbend
