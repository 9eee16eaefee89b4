// The directions of a direct block's numbers, which are duals, handed to the kernels of core/blocks/block_tangents.h.
#pragma once

#include "core/blocks/kernels.h"
#include "core/solver/block_state.h"

namespace sheetbend {

template <class T>
void values_tangents(const sheetbend_blocks::Values& values, const sheetbend_blocks::TangentKernels& kernels,
                     BlockState<T>& state, typename BlockState<T>::Values& at) {
  kernels.values(values, {state.value_directions.data(), at.x.directions(), at.C.directions()});
}

template <class T>
void refer_tangents(const sheetbend_blocks::References& references, int size,
                    const sheetbend_blocks::TangentKernels& kernels, BlockState<T>& state) {
  kernels.refer(references, size, {state.now.C.directions(), state.before.C.directions(), state.C_r.directions()});
}

// The directions' share of one iteration: after the values are solved for, before they are pushed. solve_sparse(b) is for blocks that are no band.
template <class T, class Solve>
void project_tangents(const DirectBlock& block, const sheetbend_blocks::TangentKernels& kernels,
                      const sheetbend_blocks::Block& arrays, BlockState<T>& state, int iteration,
                      Solve&& solve_sparse) {
  auto& own = state.at(iteration);
  sheetbend_blocks::Tangents t{};
  t.values = state.value_directions.data();
  t.x = state.at(state.x, iteration).directions();
  t.x_next = state.at(state.x, iteration + 1).directions();
  t.lambda = state.at(state.lambda, iteration).directions();
  t.lambda_next = state.at(state.lambda, iteration + 1).directions();
  t.C_r = state.C_r.directions();
  t.dl = own.dl.directions();
  t.u = own.u.directions();
  kernels.right_side(arrays, t);
  add_volume_tangents<T>(block, arrays, t, state);
  if (block.banded())
    kernels.solve(arrays, t.dl);
  else
    solve_sparse(numbers_of<Pack>(t.dl));
  kernels.push(arrays, t);
}

}  // namespace sheetbend
