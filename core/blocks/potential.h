// The kernels of potential_kernels.h. Kinds::of(kind) gives what a kind adds (sheetbend_blocks::PotentialOfKind).
#pragma once

#include <algorithm>

#include "core/blocks/potential_kernels.h"

namespace sheetbend {

template <class Kinds>
struct PotentialOfBlock {
  using Potential = sheetbend_blocks::Potential;

  static double evaluate(const Potential& b) {
    for (double* sums : {b.force, b.magnitude, b.stiffness})
      std::fill_n(sums, sheetbend_blocks::row * static_cast<long>(b.particles), 0.0);
    double energy = 0.0;
    for (int r = 0; r < b.run_count; ++r) energy += Kinds::of(b.runs[r].kind).evaluate(b, b.runs[r]);
    return 0.5 * energy;
  }

  static void find_elements(const Potential& b) {
    for (int r = 0; r < b.run_count; ++r) Kinds::of(b.runs[r].kind).find_elements(b, b.runs[r], b.elements[r]);
  }

  static void multiply(const Potential& b, const double* z, double* Ez) {
    for (int r = 0; r < b.run_count; ++r) Kinds::of(b.runs[r].kind).multiply(b.runs[r], b.elements[r], z, Ez);
  }

  static constexpr sheetbend_blocks::PotentialKernels all{&evaluate, &find_elements, &multiply};
};

}  // namespace sheetbend
