// What may touch itself: segments of ropes, edges of cloth and capsules of bodies against each other, and particles of cloth against its triangles. Their
// corners are spots: nodes, or points of bodies, which are weighted sums of a body's center and its axes (core/contact/spots.h).
#pragma once

#include <array>
#include <compare>
#include <vector>

namespace sheetbend {

struct SelfContact {
  std::vector<std::array<int, 2>> edges;
  std::vector<std::array<int, 3>> triangles;
  std::vector<int> points;  // that may touch triangles
  std::vector<int> radius;  // per spot: place in Quantity::contact_radius, -1 where it touches nothing
  // With friction: its place in Quantity::friction, and pinned nodes of the scene, two for each pair that may touch at a time. One's coordinates say which
  // pair, and what it does (coded() below), the other's are the tangential force that it carries [N].
  int friction = -1;
  std::vector<std::array<int, 2>> carried = {};
  // A spot below this number is a node, and one from it on a point of a body: the center and the axes. Their weights (points, 4) stand in
  // Quantity::contact_weight.
  int nodes = 0;
  std::vector<std::array<int, 4>> on_bodies = {};
  std::size_t first_weight = 0;

  int spots() const { return nodes + static_cast<int>(on_bodies.size()); }
  // A node that stands for all that moves as one: that of a spot, or the center of its body.
  int whole(int spot) const { return spot < nodes ? spot : on_bodies[spot - nodes][0]; }
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

// The four spots: two of each edge, or the point and the corners.
inline std::array<int, 4> spots_of(const SelfContact& s, const PairKey& pair) {
  if (pair.triangle) {
    const auto& t = s.triangles[pair.second];
    return {s.points[pair.first], t[0], t[1], t[2]};
  }
  const auto &a = s.edges[pair.first], &b = s.edges[pair.second];
  return {a[0], a[1], b[0], b[1]};
}

}  // namespace sheetbend
