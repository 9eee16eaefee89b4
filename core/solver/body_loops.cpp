#include "core/solver/body_loops.h"

#include <map>
#include <numeric>

namespace sheetbend {

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
  for (const Member& m : members) {
    const Group& group = scene.groups[m.group];
    if (group.rows != 3 || group.arity != 8) continue;  // `coincide` of two bodies, whose centers come first
    const auto end = [&](int k) {
      const int node = group.nodes(m.item)[k];
      const auto found = body_of.find(node);
      return scene.role[node] != Role::free ? ground : found == body_of.end() ? -1 : found->second;
    };
    if (end(0) < 0 || end(1) < 0 || (end(0) == ground && end(1) == ground)) continue;  // such as a pinned mean
    const int a = root(end(0)), b = root(end(1));
    if (a == b) return true;
    joined[a] = b;
  }
  return false;
}

}  // namespace sheetbend
