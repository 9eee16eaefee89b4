// Joints between bodies, about or along the second axis of both, and the ground.
#pragma once

#include "tests/cpp/support/bodies.h"

namespace sheetbend::testing {

// Turned about y by theta from straight down: the first axis points there.
inline std::array<Vec3<double>, 3> hanging(double theta) {
  const double c = std::cos(theta), s = std::sin(theta);
  return {{{s, 0, -c}, {0, 1, 0}, {c, 0, s}}};
}

// A body that stands still at the origin: all its nodes are pinned.
inline Body ground(BodyScene& s, const std::array<Vec3<double>, 3>& R = hanging(0.0)) {
  Body b{s.add_node({}, 1.0), {}};
  for (int k = 0; k < 3; ++k) b.axes[k] = s.add_node(R[k], 1.0);
  s.spec.pinned.insert(s.spec.pinned.end(), {b.center, b.axes[0], b.axes[1], b.axes[2]});
  s.spec.bodies.push_back(b);
  return b;
}

inline std::vector<int> nodes_of(const Body& a, const Body& b, bool centers) {
  std::vector<int> nodes;
  if (centers) nodes = {a.center, b.center};
  nodes.insert(nodes.end(), a.axes.begin(), a.axes.end());
  nodes.insert(nodes.end(), b.axes.begin(), b.axes.end());
  return nodes;
}

// Keeps the second axes of both together.
inline void hold_axis(BodyScene& s, const Body& a, const Body& b) {
  s.add("across", nodes_of(a, b, false), {0, 1, 0, 1, 0, 0});
  s.add("across", nodes_of(a, b, false), {0, 1, 0, 0, 0, 1});
}

// X and Y are places in the bodies.
inline void hinge(BodyScene& s, const Body& a, const Vec3<double>& X, const Body& b, const Vec3<double>& Y) {
  s.add("coincide", nodes_of(a, b, true), {X.x, X.y, X.z, Y.x, Y.y, Y.z});
  hold_axis(s, a, b);
}

inline void cylinder(BodyScene& s, const Body& a, const Vec3<double>& X, const Body& b, const Vec3<double>& Y) {
  s.add("along", nodes_of(a, b, true), {X.x, X.y, X.z, Y.x, Y.y, Y.z, 1, 0, 0, 0});
  s.add("along", nodes_of(a, b, true), {X.x, X.y, X.z, Y.x, Y.y, Y.z, 0, 0, 1, 0});
  hold_axis(s, a, b);
}

inline void slider(BodyScene& s, const Body& a, const Vec3<double>& X, const Body& b, const Vec3<double>& Y) {
  cylinder(s, a, X, b, Y);
  s.add("across", nodes_of(a, b, false), {1, 0, 0, 0, 0, 1});
}

}  // namespace sheetbend::testing
