// What a chain of hinged bodies costs in direct blocks, next to a rope of as many segments (measure.py's `chain`) in the same run: both with BDF2 and two iterations per
// substep, hanging from one end. Prints nanoseconds of the processor per body or segment and substep, and their ratios.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <functional>

#include "adjoint/rollout/rollout.h"
#include "core/scalar/vec3.h"
#include "core/scene/scene.h"
#include "core/solver/plan.h"
#include "tests/cpp/support/bodies.h"

namespace sheetbend {
namespace {

constexpr double h = 1.0 / 600;

struct Hanging {
  Scene scene;
  std::vector<double> inputs;
  int links;
};

Hanging rope(int segments) {
  constexpr double length = 1.0, density = 0.05, EA = 1e4, EI = 1e-3;
  const double l = length / segments;
  SceneSpec spec;
  spec.particles = segments + 1;
  spec.pinned = {0};
  GroupSpec links{"links", "distance", false, {}}, bends{"bends", "bend", true, {}};
  for (int k = 0; k < segments; ++k) links.stencil.insert(links.stencil.end(), {k, k + 1});
  for (int k = 1; k < segments; ++k) bends.stencil.insert(bends.stencil.end(), {k - 1, k, k + 1});
  spec.groups = {links, bends};
  Hanging r{build_scene(spec), {}, segments};
  r.inputs.resize(r.scene.layout.total());
  const Inputs<double> in{r.scene.layout, r.inputs.data()};
  for (int k = 0; k <= segments; ++k) {
    in.of(Quantity::position)[3 * k] = l * k;
    in.of(Quantity::mass)[k] = density * l;
  }
  for (int k = 0; k < segments; ++k) in.of(Quantity::compliance)[k] = l / EA, in.of(Quantity::rest)[k] = l;
  for (int k = segments; k < r.scene.constraints; ++k)
    in.of(Quantity::compliance)[k] = l / EI, in.of(Quantity::damping)[k] = 0.01 * EI / l;
  in.of(Quantity::gravity)[2] = -9.81;
  return r;
}

Hanging bodies(int count) {
  testing::BodyScene s;
  const double l = 1.0 / count;
  const auto axes_of = [](const Body& a, const Body& b, bool centers) {
    std::vector<int> nodes;
    if (centers) nodes = {a.center, b.center};
    nodes.insert(nodes.end(), a.axes.begin(), a.axes.end());
    nodes.insert(nodes.end(), b.axes.begin(), b.axes.end());
    return nodes;
  };
  Body above{s.add_node({}, 1.0), {}};
  for (int k = 0; k < 3; ++k) above.axes[k] = s.add_node(s.upright()[k], 1.0);
  s.spec.bodies.push_back(above);
  s.spec.pinned = {above.center, above.axes[0], above.axes[1], above.axes[2]};
  const double m = 0.05 * l, I = m * l * l / 6;
  for (int k = 0; k < count; ++k) {
    const Body b = s.add_body({l * (k + 0.5), 0, 0}, m, {I, I, I}, s.upright());
    const int e = k % 2 + 1, f = 2 - k % 2;  // hinges about y and z in turn
    std::vector<double> across(6), other(6);
    across[e] = other[e] = across[3] = other[3 + f] = 1.0;
    s.add("coincide", axes_of(above, b, true), {k == 0 ? 0.0 : 0.5 * l, 0, 0, -0.5 * l, 0, 0});
    s.add("across", axes_of(above, b, false), across);
    s.add("across", axes_of(above, b, false), other);
    above = b;
  }
  Hanging r{build_scene(s.spec), {}, count};
  r.inputs = s.inputs(r.scene);
  return r;
}

double nanoseconds(const std::function<void()>& work) {
  double best = 1e300;
  for (int repeat = 0; repeat < 5; ++repeat) {
    const std::clock_t start = std::clock();
    work();
    best = std::min(best, 1e9 / CLOCKS_PER_SEC * static_cast<double>(std::clock() - start));
  }
  return best;
}

struct Times {
  double forward, gradient;  // per link and substep
};

Times measure(const Hanging& it) {
  const int steps = std::max(3, 20000 / it.links);
  const Plan plan = make_plan(it.scene, {.h = h, .partition = Partition::direct, .iterations = 2});
  const double work = static_cast<double>(steps) * it.links;
  std::vector<double> x(it.scene.dofs()), x_bar(it.scene.dofs(), 1.0), bar(it.inputs.size());
  const double forward =
      nanoseconds([&] { rollout_states<double>(it.scene, plan, it.inputs.data(), 0.0, {steps}, x.data(), nullptr); });
  const double gradient = nanoseconds([&] {
    Tape<double> tape =
        record_rollout<double>(it.scene, plan, it.inputs.data(), 0.0, {steps}, x.data(), steps + 1, nullptr);
    reverse_rollout<double>(it.scene, plan, it.inputs.data(), 0.0, tape, {steps}, x_bar.data(), bar.data(), nullptr);
  });
  return {forward / work, gradient / work};
}

}  // namespace
}  // namespace sheetbend

int main() {
  using namespace sheetbend;
  std::printf("%8s %12s %12s %12s %12s %12s\n", "links", "segment, ns", "body, ns", "body/segment", "gradient",
              "to 20 bodies");
  double first = 0.0;
  for (const int links : {20, 100, 1000}) {
    const Times segment = measure(rope(links)), body = measure(bodies(links));
    if (first == 0.0) first = body.forward;
    std::printf("%8d %12.0f %12.0f %12.2f %12.2f %12.2f\n", links, segment.forward, body.forward,
                body.forward / segment.forward, body.gradient / body.forward, body.forward / first);
  }
}
