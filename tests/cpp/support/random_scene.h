// Random scenes that hold every registered constraint and every differentiable quantity. Each rope strings
// together one sample stencil of every kind, jittered, and braces. Ropes start at one driven particle, so
// that constraints of one color, and direct blocks, share it; or, as a net, at one free particle and with
// ties between them: one block with branches and loops. Joints bring the directors of their edges, or two edges with
// sections that shear, and the set of those that yield; two bodies with what joins them on a damped and an undamped one. A closed surface may hang on each rope, one of them with a driven particle, another with a pinned one.
#pragma once

#include "core/scene/scene.h"
#include "tests/cpp/support/compare.h"

namespace sheetbend::testing {

struct Sample {
  Scene scene;
  std::vector<double> inputs;
};

struct SceneShape {
  int ropes = 5;  // the first two are damped; five of them make a net sparse
  bool net = false;
  bool unilateral = false;  // also those kinds, which direct blocks do not hold
  bool volumes = false;     // which leave no chain, and implicit blocks do not hold
  bool directors = true;    // kinds that have them; in implicit blocks these random frames would turn too far at once
};

Sample random_scene(unsigned seed, const SceneShape& shape = {});

}  // namespace sheetbend::testing
