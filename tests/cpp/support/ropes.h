// Ropes for the tests of equilibrium: a catenary, a cantilever, the hanging loop of a wire.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "core/equilibrium/equilibrium.h"
#include "core/scalar/vec3.h"
#include "core/scene/scene.h"

namespace sheetbend::testing {

constexpr double g = 9.81;

// A rope of n links between particles `first` and `first + n`; with a clamp, the particles before and after them hold its direction.
struct Rope {
  Scene scene;
  std::vector<double> inputs;
  int links, first;

  double* of(Quantity q) { return inputs.data() + scene.layout.of(q); }
  double* position(int k) { return of(Quantity::position) + 3 * (first + k); }
  void set_position(int k, double x, double y, double z) { Vec3<double>(x, y, z).store(position(k)); }
  Equilibrium solve(const EquilibriumOptions& options = {}) const {
    return EquilibriumSolver(scene).solve(inputs.data(), nullptr, nullptr, options);
  }
  Vec3<double> point(const Equilibrium& e, int k) const { return Vec3<double>(&e.x[3 * (first + k)]); }
};

struct RopeShape {
  int links = 10;
  double length = 1.0, density = 0.05, EA = 0.0, EI = 0.0;  // EA = 0: rigid links; EI = 0: no bending
  bool clamp_first = false, clamp_last = false, hold_last = true;
  double clamp_share = 0.5;  // of a link that bends in the clamp's joint
};

inline Rope make_rope(const RopeShape& s) {
  const int first = s.clamp_first ? 1 : 0, last = first + s.links, particles = last + 1 + (s.clamp_last ? 1 : 0);
  SceneSpec spec;
  spec.particles = particles;
  for (int k = 0; k <= first; ++k) spec.pinned.push_back(k);
  if (s.hold_last)
    for (int k = last; k < particles; ++k) spec.pinned.push_back(k);
  spec.loaded = {last - 1, last};
  spec.force.times = {0.0};
  GroupSpec link{"link", "distance", false, {}}, bend{"bend", "bend", false, {}};
  for (int k = first; k < last; ++k) link.stencil.insert(link.stencil.end(), {k, k + 1});
  for (int k = 1; k + 1 < particles; ++k) bend.stencil.insert(bend.stencil.end(), {k - 1, k, k + 1});
  spec.groups = {link};
  if (s.EI > 0.0) spec.groups.push_back(bend);

  Rope rope{build_scene(spec), {}, s.links, first};
  rope.inputs.assign(rope.scene.layout.total(), 0.0);
  const double l = s.length / s.links;
  for (int k = 0; k <= s.links; ++k)
    rope.of(Quantity::mass)[first + k] = s.density * l * (k == 0 || k == s.links ? 0.5 : 1.0);
  for (int k = 0; k < s.links; ++k) {
    rope.of(Quantity::rest)[k] = l;
    rope.of(Quantity::compliance)[k] = s.EA > 0.0 ? l / s.EA : 0.0;
  }
  if (s.EI > 0.0)
    for (int c = 0; c < particles - 2; ++c) {
      const bool in_clamp = (s.clamp_first && c == 0) || (s.clamp_last && c == particles - 3);
      rope.of(Quantity::compliance)[s.links + c] = (in_clamp ? s.clamp_share : 1.0) * l / s.EI;
    }
  rope.of(Quantity::gravity)[2] = -g;
  return rope;
}

// Both ends at one height, `span` apart, starting on a parabola above or below them.
inline Rope make_catenary(int links, double span, double depth, double EA = 0.0) {
  Rope rope = make_rope({.links = links, .EA = EA});
  for (int k = 0; k <= links; ++k) {
    const double s = static_cast<double>(k) / links;
    rope.set_position(k, span * s, 0.0, -4.0 * depth * s * (1.0 - s));
  }
  return rope;
}

// Horizontal along x from its clamp at the origin, free at the other end.
inline Rope make_cantilever(int links, double EI, double density) {
  Rope rope =
      make_rope({.links = links, .density = density, .EA = 1e7, .EI = EI, .clamp_first = true, .hold_last = false});
  for (int k = -1; k <= links; ++k) rope.set_position(k, static_cast<double>(k) / links, 0.0, 0.0);
  return rope;
}

// The hanging loop of a soft wire between two holders that point outwards, from a circle on which every link fits only roughly.
inline Rope make_wire(double EI, double EA, double up = -1.0, double sideways = 0.0) {
  const int n = 200;
  const double length = 1.5, gap = 0.125, radius = length / (2.0 * std::numbers::pi);
  Rope rope = make_rope(
      {.links = n, .length = length, .density = 0.0174, .EA = EA, .EI = EI, .clamp_first = true, .clamp_last = true});
  for (int k = 0; k <= n; ++k) {
    const double s = static_cast<double>(k) / n, turn = 2.0 * std::numbers::pi * s;
    rope.set_position(k, gap * (0.5 - s) + radius * std::sin(turn), sideways * std::sin(turn),
                      up * radius * (1.0 - std::cos(turn)));
  }
  rope.set_position(0, 0.5 * gap, 0.0, 0.0);
  rope.set_position(n, -0.5 * gap, 0.0, 0.0);
  rope.set_position(-1, 0.5 * gap - length / n, 0.0, 0.0);
  rope.set_position(n + 1, -0.5 * gap + length / n, 0.0, 0.0);
  return rope;
}

}  // namespace sheetbend::testing
