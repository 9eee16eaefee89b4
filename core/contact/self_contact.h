// What may touch itself: segments of ropes and edges of cloth against each other, and particles of cloth against its triangles.
#pragma once

#include <array>
#include <compare>
#include <vector>

namespace sheetbend {

struct SelfContact {
  std::vector<std::array<int, 2>> edges;
  std::vector<std::array<int, 3>> triangles;
  std::vector<int> points;  // that may touch triangles
  std::vector<int> radius;  // per node: place in Quantity::contact_radius, -1 where it touches nothing

  bool empty() const { return edges.empty(); }
};

// Two edges, or a point and a triangle, by their places in the lists.
struct PairKey {
  bool triangle;
  int first, second;
  auto operator<=>(const PairKey&) const = default;
};

// The four nodes: two of each edge, or the point and the corners.
inline std::array<int, 4> nodes_of(const SelfContact& s, const PairKey& pair) {
  if (pair.triangle) {
    const auto& t = s.triangles[pair.second];
    return {s.points[pair.first], t[0], t[1], t[2]};
  }
  const auto &a = s.edges[pair.first], &b = s.edges[pair.second];
  return {a[0], a[1], b[0], b[1]};
}

}  // namespace sheetbend
