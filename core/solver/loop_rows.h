// Rows of a loop of bodies that others say already, as two hinges of a door have them. They follow from the others only where the bodies are as the joints
// let them: in the prediction of a substep, which drag, loads and kept spins turn apart by some angle, such a row keeps about the square of that angle of its
// own diagonal as pivot, and would push with forces that nothing asks for. So they are looked for once per substep, at the state that it starts from, and
// have a compliance beyond all others in all of its iterations: tangents and reverse need nothing of their own.
#pragma once

#include "core/solver/project_block.h"

namespace sheetbend {

inline constexpr double beyond_all = 1e150;  // D of such a row, whose square is still a number

// x: the state that the substep starts from. Comes after begin_block().
template <class T>
void let_loop_rows_give_way(const SubstepState<T>& s, const DirectBlock& block,
                            const sheetbend_packs::KernelTable& table, const T* x, BlockState<T>& state) {
  if (block.loop_pivot == 0.0) return;
  fill_values(s, block, state);
  load_coordinates(s.scene, block, x, state.x[0]);
  const auto& kernels = forward_kernels<Plain<T>>(table);
  kernels.evaluate(arrays_of(block, runs_of(s, block, state), state, 0));
  evaluate_volumes(s.scene, s.inputs, block, state, 0);
  if (block.condensation) {
    const auto& left_out = state.independent.left_out(numbers_of_block(block, state, 0), block.loop_pivot);
    for (int row = 0; row < block.size(); ++row)
      state.diagonal[row] = chosen(left_out[row], T(beyond_all), T(state.diagonal[row]));
  } else {
    factor_sparse(block, kernels, state, 0);
    for (int row = 0; row < block.size(); ++row) {
      const T D = state.diagonal[row];
      state.diagonal[row] = select(state.at(0).factor.inverse[row] > Plain<T>(0.0), D, T(beyond_all));
    }
  }
  load_coordinates(s.scene, block, s.q, state.x[0]);
}

}  // namespace sheetbend
