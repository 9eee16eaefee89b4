#include "adjoint/observe/cloud_of_cloth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>

#include "core/contact/box_grid.h"

namespace sheetbend {
namespace {

constexpr double same_distance = 1e-9;  // of distances that are compared

void gather_corners(const ClothSurface& s, const double* x, std::size_t triangle, double* to) {
  for (const int vertex : s.corners[triangle]) to = std::copy_n(x + 3 * static_cast<std::size_t>(vertex), 3, to);
}

double distance_of_closest_vertex(const ClothSurface& s, const double* x, const double* point) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t v = 0; v < s.vertices.size(); ++v) {
    const Vec3<double> off = Vec3<double>(x + 3 * v) - Vec3<double>(point);
    least = std::min(least, dot(off, off));
  }
  return std::sqrt(least);
}

bool is_at_border(const std::array<bool, 6>& border, const Part& part) {
  if (part.first < 0) return false;
  if (part.second < 0) return border[static_cast<std::size_t>(part.first)];
  return border[static_cast<std::size_t>(3 + triangle_edges[part.first][part.second])];
}

}  // namespace

ClothSurface make_cloth_surface(std::vector<int> vertices, std::vector<std::array<int, 3>> corners) {
  ClothSurface s{std::move(vertices), std::move(corners), {}};
  const auto count = static_cast<int>(s.vertices.size());
  std::map<std::pair<int, int>, int> triangles_at;  // by edge
  const auto edge = [](const std::array<int, 3>& t, int e) {
    return std::minmax(t[static_cast<std::size_t>(triangle_edges[e][0])],
                       t[static_cast<std::size_t>(triangle_edges[e][1])]);
  };
  for (const std::array<int, 3>& t : s.corners) {
    if (*std::ranges::min_element(t) < 0 || *std::ranges::max_element(t) >= count)
      throw std::invalid_argument("surface: a triangle has a corner beyond its " + std::to_string(count) + " vertices");
    for (int e = 0; e < 3; ++e) ++triangles_at[edge(t, e)];
  }
  std::vector<bool> outer(s.vertices.size());
  for (const auto& [ends, triangles] : triangles_at)
    if (triangles == 1)
      outer[static_cast<std::size_t>(ends.first)] = outer[static_cast<std::size_t>(ends.second)] = true;
  for (const std::array<int, 3>& t : s.corners) {
    std::array<bool, 6>& border = s.borders.emplace_back();
    for (int k = 0; k < 3; ++k) {
      border[static_cast<std::size_t>(k)] = triangles_at[edge(t, k)] == 1;
      border[static_cast<std::size_t>(3 + k)] = outer[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])];
    }
  }
  return s;
}

std::vector<ClosestPart> closest_parts(const ClothSurface& s, const double* x, const double* points,
                                       std::size_t count) {
  std::vector<int> seen;
  std::vector<Box> around, triangles;
  for (std::size_t i = 0; i < count; ++i) {
    const double* point = points + 3 * i;
    if (std::isnan(point[0])) continue;
    // No triangle farther away than that can be the closest.
    const double reach = (1.0 + same_distance) * distance_of_closest_vertex(s, x, point);
    seen.push_back(static_cast<int>(i));
    around.push_back({{point[0] - reach, point[1] - reach, point[2] - reach},
                      {point[0] + reach, point[1] + reach, point[2] + reach}});
  }
  double at[12];
  for (std::size_t t = 0; t < s.corners.size(); ++t) {
    gather_corners(s, x, t, at);
    Box& box = triangles.emplace_back();
    for (int d = 0; d < 3; ++d) {
      box.low[d] = std::min({at[d], at[3 + d], at[6 + d]});
      box.high[d] = std::max({at[d], at[3 + d], at[6 + d]});
    }
  }
  std::vector<std::pair<int, int>> pairs = overlaps(around, triangles, false);
  std::ranges::sort(pairs);
  std::vector<ClosestPart> found(count);
  std::vector<double> least(count, std::numeric_limits<double>::infinity()), off(count, 0.0);
  for (const auto& [number, triangle] : pairs) {
    const auto i = static_cast<std::size_t>(seen[static_cast<std::size_t>(number)]);
    const auto t = static_cast<std::size_t>(triangle);
    std::copy_n(points + 3 * i, 3, at);
    gather_corners(s, x, t, at + 3);
    const Part part = part_of_triangle(at);
    const double distance = std::sqrt(nearest_on_triangle(at, part).squared), plane = std::abs(plane_distance(at));
    // Triangles share the edge or the corner that is closest; the one whose plane is farthest tells on which side the point is.
    const double equal = same_distance * least[i];
    if (distance > least[i] + equal || (distance >= least[i] - equal && plane <= off[i])) continue;
    least[i] = std::min(least[i], distance);
    off[i] = plane;
    found[i] = {triangle, part, is_at_border(s.borders[t], part)};
  }
  return found;
}

}  // namespace sheetbend
