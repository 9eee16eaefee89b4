#include "adjoint/observe/cloud_of_ropes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace sheetbend {
namespace {

constexpr double same_square = 1e-9;  // of squared distances that are compared

}  // namespace
RopeLines make_rope_lines(std::vector<int> vertices, std::vector<std::array<int, 2>> links) {
  RopeLines s{std::move(vertices), std::move(links), {}};
  const auto count = static_cast<int>(s.vertices.size());
  std::vector<int> links_at(s.vertices.size());
  for (const std::array<int, 2>& link : s.links)
    for (const int vertex : link) {
      if (vertex < 0 || vertex >= count)
        throw std::invalid_argument("ropes: a link has an end beyond their " + std::to_string(count) + " vertices");
      ++links_at[static_cast<std::size_t>(vertex)];
    }
  for (const auto& [first, second] : s.links)
    s.ends.push_back({links_at[static_cast<std::size_t>(first)] == 1, links_at[static_cast<std::size_t>(second)] == 1});
  return s;
}

std::vector<ClosestLink> closest_parts(const RopeLines& s, const double* x, const double* points, std::size_t count) {
  std::vector<ClosestLink> found(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3<double> point(points + 3 * i);
    if (std::isnan(point.x)) continue;
    double least = std::numeric_limits<double>::infinity(), across = 0.0;
    for (std::size_t l = 0; l < s.links.size(); ++l) {
      const auto [first, second] = s.links[l];
      const Vec3<double> a(x + 3 * static_cast<std::size_t>(first));
      const Vec3<double> along = Vec3<double>(x + 3 * static_cast<std::size_t>(second)) - a;
      const double share = dot(point - a, along) / dot(along, along), held = std::clamp(share, 0.0, 1.0);
      const Vec3<double> off = point - a - held * along, off_line = point - a - share * along;
      const double squared = dot(off, off), line = dot(off_line, off_line);
      // Two links share the particle that is closest; the one whose line is farther counts, so that the choice does not hang on rounding.
      const double equal = same_square * least;
      if (squared > least + equal || (squared >= least - equal && line <= across)) continue;
      least = std::min(least, squared);
      across = line;
      const int at = share <= 0.0 ? 0 : share >= 1.0 ? 1 : -1;
      found[i] = {static_cast<int>(l), at, at >= 0 && s.ends[l][static_cast<std::size_t>(at)]};
    }
  }
  return found;
}

}  // namespace sheetbend
