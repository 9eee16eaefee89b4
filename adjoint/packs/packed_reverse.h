// The reverse of the sweeps over packed colors.
#pragma once

#include "core/packs/packed_colors.h"

namespace sheetbend {

// Cotangents in the kernels' order (T: double, Pack). Those of the constraints' values gather over substeps of one eta; finish() hands them on.
template <class T>
struct PackCotangents {
  Rows<T> rows;
  std::vector<ColorNumbers<T>> colors;
  double eta = 0.0;

  void resize(const PackPlan& plan);
  static std::size_t bytes(const PackPlan& plan);  // that resize() allocates
};

// Before the iterations that `state` recorded are reversed, the last one first. The nodes' rows of `bar` hold the cotangents of the coordinates
// after them, and then of those before, with those of the inverse masses in the fourth place.
template <class T>
void begin_sweeps_vjp(const Scene& scene, const PackPlan& plan, int threads, const Inputs<const T>& in,
                      const PackState<T>& state, const Inputs<T>& in_bar, PackCotangents<T>& bar);

// Reverse of one sweep; of the multipliers after the last nothing arrives.
template <class T>
void sweep_vjp(const PackPlan& plan, const sheetbend_packs::KernelTable& kernels, int threads, int grain, int iteration,
               bool last, PackState<T>& state, PackCotangents<T>& bar);

// After them: the cotangents of the inverse masses w_bar (nodes) and of the references C_r_bar (rows of the scene) are added to.
template <class T>
void end_sweeps_vjp(const Scene& scene, const PackPlan& plan, int threads, PackCotangents<T>& bar, T* w_bar,
                    T* C_r_bar);

// Adds the gathered cotangents of the constraints' values to those of the inputs, and forgets them.
template <class T>
void finish(const Scene& scene, const PackPlan& plan, const Inputs<const T>& in, const Inputs<T>& in_bar,
            PackCotangents<T>& bar);

}  // namespace sheetbend
