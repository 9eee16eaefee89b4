// Distances of an unordered cloud of points, such as a depth camera's, from the cloth of a scene.
//
// A point of a cloud has no name: all that it says is how far the surface is from it. So it leaves one residual, its signed distance from the
// closest point of the triangles. Which part of which triangle is closest is found by values. The distance from that part has a closed form over
// any scalar, and its derivative is exact: the closest point moves within the surface, across which the distance is measured.
//
// Noise moves points over the border of a cloth as well, by about as much as it moves them off the cloth. There the distance is that from the plane
// of the triangle, as if the cloth went on, so that noise does not pull at the border. Only what is farther over it than `overhang` counts on top.
#pragma once

#include <array>
#include <vector>

#include "adjoint/observe/cloud_border.h"
#include "core/contact/nearest.h"

namespace sheetbend {

struct ClothSurface {
  static constexpr std::size_t rows = 1;  // residuals of a point

  std::vector<int> vertices;                // first coordinate of each
  std::vector<std::array<int, 3>> corners;  // of each triangle, which vertices
  std::vector<std::array<bool, 6>>
      borders;  // of each triangle, whether its edges (0 1), (1 2), (2 0) and its corners are at the border
};

// Throws std::invalid_argument where a triangle names no vertex.
ClothSurface make_cloth_surface(std::vector<int> vertices, std::vector<std::array<int, 3>> corners);

struct ClosestPart {
  int triangle = -1;  // none for a point that is not seen
  Part part;
  bool at_border = false;

  bool is_none() const { return triangle < 0; }
};

// Of each point (count, 3), NaN where it is not seen, for vertices at x (vertices, 3).
std::vector<ClosestPart> closest_parts(const ClothSurface& s, const double* x, const double* points, std::size_t count);

inline const std::array<int, 3>& corners_of(const ClothSurface& s, const ClosestPart& closest) {
  return s.corners[static_cast<std::size_t>(closest.triangle)];
}

// Where on the triangle a point is closest; x: a point and the three corners.
template <class T>
Vec3<T> closest_place(const T* x, const ClosestPart& closest) {
  return Vec3<T>(x) - nearest_on_triangle(x, closest.part).apart;
}

// Signed distance from the plane of a triangle; x as above.
template <class T>
T plane_distance(const T* x) {
  const Vec3<T> a(x + 3), n = cross(Vec3<T>(x + 6) - a, Vec3<T>(x + 9) - a);
  return dot(n, Vec3<T>(x) - a) / norm(n);
}

// Signed distance from the closest part of a triangle; x as above, sigma that of the point.
template <class T>
T surface_distance(const T* x, const ClosestPart& closest, double sigma) {
  constexpr double negligible = 1e-4;  // of sigma: there a distance from an edge has no derivative
  const T off = plane_distance(x);
  if (closest.part.first < 0) return off;
  const T squared = nearest_on_triangle(x, closest.part).squared;
  const T side(value_of(off) < 0.0 ? -1.0 : 1.0);
  if (!closest.at_border) {
    const double least = negligible * sigma;
    return value_of(squared) < least * least ? off : side * sqrt(squared);
  }
  const T over = squared - off * off;
  const double free = overhang * sigma;
  if (value_of(over) <= free * free) return off;
  const T beyond = sqrt(over) - T(free);
  return side * sqrt(off * off + beyond * beyond);
}

template <class T>
std::array<T, ClothSurface::rows> distances(const T* x, const ClosestPart& closest, double sigma) {
  return {surface_distance(x, closest, sigma)};
}

}  // namespace sheetbend
