// Runs of scenes in which particles bounce, and their gradients against complex steps.
#pragma once

#include "tests/cpp/support/contact_scenes.h"

namespace sheetbend::testing {

inline Program program(const Sample& s, double h, double time, Integrator integrator) {
  return {s.scene, make_plan(s.scene, contact_options(h, integrator)), static_cast<int>(std::lround(time / h))};
}

// With one bounce and with several in a substep.
struct Juggle {
  Integrator integrator;
  double h;
};
inline auto juggles() {
  return ::testing::Values(Juggle{Integrator::bdf1, 1e-3}, Juggle{Integrator::bdf2, 1e-3},
                           Juggle{Integrator::bdf1, 8e-3}, Juggle{Integrator::bdf2, 8e-3});
}

// The gradient with respect to the first particles and to all inputs of contacts and colliders.
inline void expect_gradient_of_complex_steps(const Program& p, const Sample& s, std::size_t particles) {
  const auto found = gradient(p, s.inputs);
  double largest = 0.0;
  for (const double a : found) largest = std::max(largest, std::abs(a));
  for (const Quantity q :
       {Quantity::position, Quantity::velocity, Quantity::mass, Quantity::gravity, Quantity::friction,
        Quantity::restitution, Quantity::contact_radius, Quantity::collider_pose, Quantity::collider_size}) {
    const bool of_particles = q == Quantity::position || q == Quantity::velocity;
    const std::size_t count = of_particles ? 3 * particles : q == Quantity::mass ? particles : s.scene.layout.count(q);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t at = s.scene.layout.of(q) + i;
      std::vector<Complex> probe(s.inputs.begin(), s.inputs.end());
      probe[at].im = complex_step;
      const double expected = loss(p, probe).im / complex_step;
      EXPECT_NEAR(found[at], expected, 1e-11 * largest + 1e-9 * std::abs(expected))
          << quantity_names[static_cast<int>(q)] << " " << i;
    }
  }
}

}  // namespace sheetbend::testing
