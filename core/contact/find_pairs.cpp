#include "core/contact/find_pairs.h"

#include <algorithm>
#include <span>

#include "core/contact/approach.h"
#include "core/contact/box_grid.h"

namespace sheetbend {
namespace {

constexpr double slack = 0.1;  // of where two touch, by which they may be listed too early

// Around spots on their ways, as far as they reach, and half of what must stay free around them.
Box box_around(std::span<const int> spots, const Whereabouts& at) {
  double reach = 0.0;
  for (const int n : spots) reach = std::max(reach, at.reach[n]);
  reach += at.radius[spots.front()];
  Box box;
  for (int d = 0; d < 3; ++d) {
    box.low[d] = box.high[d] = at.of(spots.front())[d];
    for (const int n : spots) {
      const double from = at.of(n)[d], to = at.way ? from + at.way[3 * static_cast<long>(n) + d] : from;
      box.low[d] = std::min({box.low[d], from, to});
      box.high[d] = std::max({box.high[d], from, to});
    }
    box.low[d] -= reach;
    box.high[d] += reach;
  }
  return box;
}

template <class Items>
std::vector<Box> boxes_around(const Items& items, const Whereabouts& at) {
  std::vector<Box> boxes;
  boxes.reserve(items.size());
  for (const auto& spots : items) boxes.push_back(box_around(spots, at));
  return boxes;
}

bool may_touch(const SelfContact& s, const PairKey& key, const Whereabouts& at) {
  const auto spots = spots_of(s, key);
  const int side = key.triangle ? 1 : 2;  // where the second one begins
  for (int i = 0; i < side; ++i)
    for (int k = side; k < 4; ++k)
      if (s.whole(spots[i]) == s.whole(spots[k])) return false;
  double x[12];
  gather(spots, at.x, at.stride, x);
  const auto reach = [&](int from, int to) {
    double most = 0.0;
    for (int k = from; k < to; ++k) most = std::max(most, at.reach[spots[k]]);
    return most;
  };
  const double touching = at.radius[spots[0]] + at.radius[spots[side]];
  const double room = touching + reach(0, side) + reach(side, 4);
  const PairNumbers<double> numbers{touching, 1.0};
  if (!at.way) return distance_of(key.triangle, x, numbers) <= room;
  double way[12];
  gather(spots, at.way, 3, way);
  return comes_nearer(key.triangle, x, way, room, slack * touching, numbers);
}

}  // namespace

std::vector<PairKey> find_pairs(const SelfContact& s, const Whereabouts& at) {
  std::vector<PairKey> pairs;
  const auto take = [&](bool triangle, const std::vector<std::pair<int, int>>& found) {
    for (const auto& [first, second] : found)
      if (const PairKey key{triangle, first, second}; may_touch(s, key, at)) pairs.push_back(key);
  };
  const std::vector<Box> edges = boxes_around(s.edges, at);
  take(false, overlaps(edges, edges, true));
  if (!s.triangles.empty()) {
    std::vector<std::array<int, 1>> points;
    for (const int n : s.points) points.push_back({n});
    take(true, overlaps(boxes_around(points, at), boxes_around(s.triangles, at), false));
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace sheetbend
