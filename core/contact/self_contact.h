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
  // With friction: its place in Quantity::friction, and pinned nodes of the scene, two for each pair that may touch at a time. One's coordinates say which
  // pair, and what it does (coded() below), the other's are the tangential force that it carries [N].
  int friction = -1;
  std::vector<std::array<int, 2>> carried = {};

  bool rubs() const { return friction >= 0; }
  bool empty() const { return edges.empty(); }
};

// Two edges, or a point and a triangle, by their places in the lists.
struct PairKey {
  bool triangle;
  int first, second;
  auto operator<=>(const PairKey&) const = default;
};

// A key, and whether the pair slides, as three coordinates; zeros are none.
inline std::array<double, 3> coded(const PairKey& key, bool slides) {
  return {(key.triangle ? 2.0 : 1.0) + (slides ? 2.0 : 0.0), static_cast<double>(key.first),
          static_cast<double>(key.second)};
}
inline bool is_coded(double kind) { return kind >= 1.0; }
inline bool slides_of(double kind) { return kind > 2.0; }
inline PairKey decoded(double kind, double first, double second) {
  return {kind == 2.0 || kind == 4.0, static_cast<int>(first), static_cast<int>(second)};
}

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
