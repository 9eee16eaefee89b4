// Many copies of one constraint that share no particle: a single color, which a rollout sweeps again and again.
#pragma once

#include <algorithm>
#include <vector>

#include "adjoint/rollout/rollout.h"
#include "core/constraints/registry.h"
#include "core/scene/scene.h"
#include "core/solver/plan.h"

namespace sheetbend::bench {

struct OneColor {
  int constraints, steps;
  Scene scene;
  std::vector<double> inputs;

  // A curved stencil that is no degenerate shape of any kind, nor has a vector of zero length, moved by its number so that no two are equal.
  template <class K>
  OneColor(K, int constraints_, int steps_, bool damped) : constraints(constraints_), steps(steps_) {
    SceneSpec spec;
    spec.particles = constraints * K::arity;
    GroupSpec group{K::name, K::name, damped, {}};
    for (int n = 0; n < spec.particles; ++n) group.stencil.push_back(n);
    spec.groups.push_back(group);
    scene = build_scene(spec);
    inputs.assign(scene.layout.total(), 0.0);
    const Inputs<double> in{scene.layout, inputs.data()};
    for (int n = 0; n < spec.particles; ++n) {
      const int k = n % K::arity;
      const double at[] = {0.05 + 0.1 * k + 1e-3 * (n / K::arity), 0.02 * k * k, -0.015 * k};
      std::copy_n(at, 3, in.of(Quantity::position) + 3 * n);
    }
    std::fill_n(in.of(Quantity::mass), scene.layout.count(Quantity::mass), 0.02);
    std::fill_n(in.of(Quantity::compliance), scene.layout.count(Quantity::compliance), 1e-2);
    std::fill_n(in.of(Quantity::damping), scene.layout.count(Quantity::damping), damped ? 1e-3 : 0.0);
    // the first three are a unit vector, for those that need a normal; none is zero or above one
    const double parameters[] = {0.36, 0.48, 0.8, 0.15};
    for (std::size_t i = 0; i < scene.layout.count(Quantity::rest); ++i) {
      const std::size_t p = i % parameter_count<K>;
      // numbers that couple a material's directions must be small enough for an energy that is positive
      const bool couples = K::parameters[p].range.least < 0.0 && K::parameters[p].range.most < 1.0;
      in.of(Quantity::rest)[i] = parameters[p % 4] * (couples ? 0.3 : 1.0);
    }
  }

  Plan plan(int sweeps) const {
    return make_plan(
        scene,
        {.h = 1.0 / 600.0, .integrator = Integrator::bdf1, .partition = Partition::gauss_seidel, .iterations = sweeps});
  }

  std::vector<double> forward(const Plan& plan) const {
    std::vector<double> last(scene.dofs());
    rollout_states<double>(scene, plan, inputs.data(), 0.0, {steps}, last.data(), nullptr);
    return last;
  }

  // The gradient of the sum of the last coordinates, with the forward run that it needs.
  std::vector<double> gradient(const Plan& plan) const {
    const std::vector<double> x_bar(scene.dofs(), 1.0);
    std::vector<double> last(scene.dofs()), bar(scene.layout.total());
    auto tape = record_rollout<double>(scene, plan, inputs.data(), 0.0, {steps}, last.data(), every_state, nullptr);
    reverse_rollout<double>(scene, plan, inputs.data(), 0.0, tape, {steps}, x_bar.data(), bar.data(), nullptr);
    return bar;
  }
};

}  // namespace sheetbend::bench
