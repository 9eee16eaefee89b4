// Scenes of bodies: rods, boxes and what joins them.
#pragma once

#include <array>
#include <cmath>

#include "core/scene/scene.h"

namespace sheetbend::testing {

// Adds nodes, bodies and constraints one by one, and keeps the numbers that go into the inputs.
struct BodyScene {
  SceneSpec spec{};
  std::vector<double> x{}, v{}, mass{};
  struct Values {
    std::vector<double> p;
    double compliance, damping;
  };
  std::vector<std::vector<Values>> groups{};
  Vec3<double> gravity{0.0, 0.0, -9.81};

  int add_node(const Vec3<double>& at, double m, const Vec3<double>& velocity = {}) {
    for (const auto& [from, to] : {std::pair{&at, &x}, {&velocity, &v}})
      to->insert(to->end(), {from->x, from->y, from->z});
    mass.push_back(m);
    return spec.particles++;
  }

  // A body of inertia I about its axes (columns of R), which turns by omega (in space) and moves by velocity.
  Body add_body(const Vec3<double>& at, double m, const std::array<double, 3>& I, const std::array<Vec3<double>, 3>& R,
                const Vec3<double>& omega = {}, const Vec3<double>& velocity = {}) {
    Body b{add_node(at, m, velocity), {}};
    for (int k = 0; k < 3; ++k) b.axes[k] = add_node(R[k], 0.5 * (I[0] + I[1] + I[2]) - I[k], cross(omega, R[k]));
    spec.bodies.push_back(b);
    add("rigid", {b.axes.begin(), b.axes.end()}, {});
    return b;
  }
  // Its angular momentum becomes a state of its own.
  void keep_spin(Body& b) {
    for (Body& own : spec.bodies)
      if (own.center == b.center) own.spin = b.spin = add_node({}, 1.0);
    spec.pinned.push_back(b.spin);
  }
  static std::array<Vec3<double>, 3> upright() { return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}; }
  // Turned by `angle` about y.
  static std::array<Vec3<double>, 3> turned(double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    return {{{c, 0, -s}, {0, 1, 0}, {s, 0, c}}};
  }

  void add(const std::string& kind, const std::vector<int>& nodes, std::vector<double> p, double compliance = 0.0,
           double damping = 0.0) {
    std::size_t g = 0;
    while (g < groups.size() && spec.groups[g].kind != kind) ++g;
    if (g == groups.size()) {
      groups.emplace_back();
      spec.groups.push_back({kind, kind, false, {}});
    }
    spec.groups[g].stencil.insert(spec.groups[g].stencil.end(), nodes.begin(), nodes.end());
    spec.groups[g].damped |= damping > 0.0;
    groups[g].push_back({std::move(p), compliance, damping});
  }

  std::vector<double> inputs(const Scene& scene) const {
    std::vector<double> all(scene.layout.total());
    const Inputs<double> in{scene.layout, all.data()};
    std::copy(x.begin(), x.end(), in.of(Quantity::position));
    std::copy(v.begin(), v.end(), in.of(Quantity::velocity));
    std::copy(mass.begin(), mass.end(), in.of(Quantity::mass));
    gravity.store(in.of(Quantity::gravity));
    double *compliance = in.of(Quantity::compliance), *damping = in.of(Quantity::damping),
           *rest = in.of(Quantity::rest);
    for (const auto& group : groups)
      for (const Values& c : group) {
        *compliance++ = c.compliance;
        *damping++ = c.damping;
        rest = std::copy(c.p.begin(), c.p.end(), rest);
      }
    return all;
  }
};

}  // namespace sheetbend::testing
