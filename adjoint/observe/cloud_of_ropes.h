// Offsets of an unordered cloud of points, such as a depth camera's, from the middle lines of the ropes of a scene.
//
// A point of a cloud has no name: how far it lies from the rope is known, and not where along it. So it leaves two residuals, its offsets across the
// closest link. They are measured along two directions that are perpendicular to the link and made from it, so their squares sum to the squared
// distance from the link's line. Which link is closest is found by values. The offsets have a closed form over any scalar, and their derivatives are
// exact, since moving the point along the link changes none of them.
//
// As over the border of a cloth, a point beyond an end of a rope counts as if the rope went on, up to `overhang`.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "adjoint/observe/cloud_border.h"
#include "core/scalar/vec3.h"

namespace sheetbend {

struct RopeLines {
  static constexpr std::size_t rows = 2;  // residuals of a point

  std::vector<int> vertices;              // first coordinate of each
  std::vector<std::array<int, 2>> links;  // of each link, which vertices
  std::vector<std::array<bool, 2>> ends;  // of each link, whether its vertices are ends of a rope
};

// Throws std::invalid_argument where a link names no vertex.
RopeLines make_rope_lines(std::vector<int> vertices, std::vector<std::array<int, 2>> links);

struct ClosestLink {
  int link = -1;      // none for a point that is not seen
  int at = -1;        // where on it: inside (-1), or its first or second vertex (0, 1)
  bool over = false;  // whether the point lies beyond an end of its rope

  bool is_none() const { return link < 0; }
};

// Of each point (count, 3), NaN where it is not seen, for vertices at x (vertices, 3).
std::vector<ClosestLink> closest_parts(const RopeLines& s, const double* x, const double* points, std::size_t count);

inline const std::array<int, 2>& corners_of(const RopeLines& s, const ClosestLink& closest) {
  return s.links[static_cast<std::size_t>(closest.link)];
}

// Where on the link a point is closest; x: a point and the two vertices.
template <class T>
Vec3<T> closest_place(const T* x, const ClosestLink& closest) {
  const Vec3<T> a(x + 3), along = Vec3<T>(x + 6) - a;
  if (closest.at >= 0) return closest.at == 0 ? a : Vec3<T>(x + 6);
  return a + (dot(Vec3<T>(x) - a, along) / dot(along, along)) * along;
}

// Offsets across the link; x as above, sigma that of the point. Their directions are the second and the third axis of a frame after the shortest
// rotation that takes its first axis to the link. A link that points against the first axis has none, and takes the frame as it is.
template <class T>
std::array<T, RopeLines::rows> distances(const T* x, const ClosestLink& closest, double sigma) {
  constexpr double frame[3][3] = {{0.36, 0.48, 0.8}, {0.8, -0.6, 0.0}, {0.48, 0.64, -0.6}};
  constexpr double against = 1e-9;
  const auto along_axis = [&](int k, const Vec3<T>& v) {
    return T(frame[k][0]) * v.x + T(frame[k][1]) * v.y + T(frame[k][2]) * v.z;
  };
  const Vec3<T> a(x + 3), along = Vec3<T>(x + 6) - a, off = Vec3<T>(x) - a;
  const Vec3<T> t = (T(1.0) / norm(along)) * along;
  const T lean = T(1.0) + along_axis(0, t);
  const T turned = value_of(lean) > against ? (along_axis(0, off) + dot(t, off)) / lean : T(0.0);
  std::array<T, RopeLines::rows> offsets;
  for (int k = 0; k < 2; ++k) offsets[k] = along_axis(k + 1, off) - turned * along_axis(k + 1, t);
  if (!closest.over) return offsets;
  const T over = closest.at == 0 ? -dot(t, off) : dot(t, off) - norm(along);
  const T beyond = over - T(overhang * sigma);
  if (value_of(beyond) <= 0.0) return offsets;
  const T size = sqrt(offsets[0] * offsets[0] + beyond * beyond);
  offsets[0] = value_of(offsets[0]) < 0.0 ? -size : size;
  return offsets;
}

}  // namespace sheetbend
