// A closed surface that nothing but its volume holds: two pyramids on a ring of `sides` particles.
#pragma once

#include <cmath>

#include "core/scene/scene.h"
#include "tests/cpp/support/compare.h"
#include "tests/cpp/support/random_scene.h"

namespace sheetbend::testing {

// Ring and heights are of length one around `center`; the volume to be kept is `rest` times the initial one.
inline Sample bipyramid(int sides, double compliance = 0.0, double rest = 1.0, const Vec3<double>& center = {},
                        const std::vector<int>& pinned = {}) {
  SceneSpec spec;
  spec.particles = sides + 2;
  spec.pinned = pinned;
  spec.volumes = {{"body", {}}};
  for (int k = 0; k < sides; ++k) {
    const int next = (k + 1) % sides;
    spec.volumes[0].triangles.push_back({sides, k, next});
    spec.volumes[0].triangles.push_back({sides + 1, next, k});
  }
  Sample sample{build_scene(spec), {}};
  sample.inputs.resize(sample.scene.layout.total());
  const Inputs<double> in{sample.scene.layout, sample.inputs.data()};
  double* x = in.of(Quantity::position);
  const double turn = 2.0 * M_PI / sides;
  for (int k = 0; k < sides; ++k) (center + Vec3<double>(std::cos(k * turn), std::sin(k * turn), 0.0)).store(x + 3 * k);
  (center + Vec3<double>(0.0, 0.0, 1.0)).store(x + 3 * sides);
  (center - Vec3<double>(0.0, 0.0, 1.0)).store(x + 3 * (sides + 1));
  std::fill_n(in.of(Quantity::mass), sides + 2, 0.5);
  in.of(Quantity::volume)[0] = rest * sides * std::sin(turn) / 3.0;
  in.of(Quantity::volume_compliance)[0] = compliance;
  return sample;
}

}  // namespace sheetbend::testing
