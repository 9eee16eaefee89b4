// What is nearer to itself than it may be.
#pragma once

#include <array>
#include <vector>

#include "core/scene/scene.h"

namespace sheetbend {

// A pair of a self-contact: its gap, negative where it is too near, and its four nodes; the center of a body for its points.
struct PairGap {
  double gap;
  std::array<int, 4> nodes;
};

// Those that touch at the coordinates x (dofs).
std::vector<PairGap> pair_gaps(const Scene& scene, const Inputs<const double>& in, const double* x);

}  // namespace sheetbend
