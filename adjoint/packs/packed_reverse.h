// The reverse of the sweeps over packed colors.
#pragma once

#include "core/packs/packed_colors.h"

namespace sheetbend {

// Cotangents in the kernels' order. Those of the constraints' values gather over substeps of one eta; finish() hands them on.
struct PackCotangents {
  struct ColorCotangents {
    std::vector<Pack> values, lambda, C_r;
  };
  Rows rows;
  std::vector<ColorCotangents> colors;
  double eta = 0.0;

  void resize(const PackPlan& plan);
};

// Reverses all iterations that `state` recorded. x_bar (dofs) is that of the coordinates after them, and becomes that of those before, fixed
// nodes included; w_bar (nodes) and C_r_bar (rows of the scene) are added to.
void reverse_sweeps(const Scene& scene, const PackPlan& plan, const sheetbend_packs::KernelTable& kernels,
                    int iterations, int threads, int grain, const Inputs<const double>& in, PackState& state,
                    double* x_bar, double* w_bar, double* C_r_bar, const Inputs<double>& in_bar, PackCotangents& bar);

// Adds the gathered cotangents of the constraints' values to those of the inputs, and forgets them.
void finish(const Scene& scene, const PackPlan& plan, const Inputs<const double>& in, const Inputs<double>& in_bar,
            PackCotangents& bar);

}  // namespace sheetbend
