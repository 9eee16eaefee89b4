// What a recording sees of a state: markers at material coordinates, as weights on up to eight nodes, with an optional offset on up to four; and the time
// between two substeps. An offset is carried in the local frame (t, n, t x n) of tangent t and a given reference normal n, or, on a rigid
// body, by the body's axes, which are the last three nodes.
#pragma once

#include <array>
#include <vector>

#include "core/scalar/vec3.h"

namespace sheetbend {

struct Marker {
  int nodes = 4;                    // from four to eight
  std::array<int, 8> dof{};         // first coordinate of each node
  std::array<double, 8> weight{};   // of the position
  std::array<double, 4> tangent{};  // of the tangent (any length)
  std::array<double, 3> normal{0.0, 1.0, 0.0};
  bool carries_offset = false;
  bool on_axes = false;  // the offset counts along nodes 1 to 3
};

// x: the state at one time; offset: 3 numbers (used when the marker carries one).
template <class T>
Vec3<T> marker_position(const Marker& m, const T* x, const T* offset) {
  Vec3<T> p, t;
  for (int k = 0; k < 4; ++k) {
    const Vec3<T> node(x + m.dof[k]);
    p = p + T(m.weight[k]) * node;
    t = t + T(m.tangent[k]) * node;
  }
  for (int k = 4; k < m.nodes; ++k) p = p + T(m.weight[k]) * Vec3<T>(x + m.dof[k]);
  if (!m.carries_offset) return p;
  if (m.on_axes) {
    for (int k = 0; k < 3; ++k) p = p + offset[k] * Vec3<T>(x + m.dof[k + 1]);
    return p;
  }
  t = (T(1.0) / norm(t)) * t;
  Vec3<T> n(T(m.normal[0]), T(m.normal[1]), T(m.normal[2]));
  n = n - dot(n, t) * t;
  n = (T(1.0) / norm(n)) * n;
  return p + offset[0] * t + offset[1] * n + offset[2] * cross(t, n);
}

// Cubic Lagrange weights of substeps base-1 .. base+2 at base + u; exact for cubics, one at a substep.
template <class T>
std::array<T, 4> cubic_weights(const T& u) {
  const T one(1.0), two(2.0), half(0.5), sixth(1.0 / 6.0);
  return {-(u * (u - one) * (u - two) * sixth), (u + one) * (u - one) * (u - two) * half,
          -((u + one) * u * (u - two) * half), (u + one) * u * (u - one) * sixth};
}

}  // namespace sheetbend
