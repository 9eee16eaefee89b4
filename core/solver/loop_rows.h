// Rows of a loop of bodies that others say already, as two hinges of a door have them. They follow from the others only where the bodies are as the joints
// let them: in the prediction of a substep, which drag, loads and kept spins turn apart by some angle, such a row keeps about the square of that angle of its
// own diagonal as pivot, and would push with forces that nothing asks for. So they are looked for once per substep, at the state that it starts from, and
// have a compliance beyond all others in all of its iterations: tangents and reverse need nothing of their own.
#pragma once

#include "core/scalar/pivot.h"
#include "core/solver/project_block.h"

namespace sheetbend {

inline constexpr double beyond_all = 1e150;  // D of such a row, whose square is still a number

// The inverse pivots of the rigid rows of a condensed block in J W J^T + D, as of any constraints' matrix; one for all other rows.
template <class T>
std::vector<T> inverse_pivots_of_rigid(const BlockNumbers<T>& block, double least) {
  std::vector<int> place(block.size, -1), rigid;
  for (int row = 0; row < block.size; ++row)
    if (is_rigid(block.diagonal[row])) {
      place[row] = static_cast<int>(rigid.size());
      rigid.push_back(row);
    }
  const std::size_t n = rigid.size();
  std::vector<T> L(n * n, T(0.0)), inverse(n), pivots(block.size, T(1.0));
  for (std::size_t v = 0; v < n; ++v) L[v * n + v] = block.diagonal[rigid[v]];
  for (int p = 0; p < block.movable; ++p)
    for (int i = block.window[p]; i < block.window[p + 1]; ++i)
      for (int k = block.window[p]; k < block.window[p + 1]; ++k) {
        const int v = place[block.rows[i]], w = place[block.rows[k]];
        if (w >= 0 && w <= v)
          L[v * n + w] += block.inverse_mass(p) * dot(Vec3<T>(block.gradient(i)), Vec3<T>(block.gradient(k)));
      }
  // Columns stay as they are before the division by their pivot.
  for (std::size_t v = 0; v < n; ++v) {
    const T diagonal = L[v * n + v];
    for (std::size_t w = 0; w <= v; ++w)
      for (std::size_t k = 0; k < w; ++k) L[v * n + w] -= L[v * n + k] * inverse[k] * L[w * n + k];
    inverse[v] = inverse_pivot(L[v * n + v], diagonal, least);
    pivots[rigid[v]] = inverse[v];
  }
  return pivots;
}

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
  const auto give_way = [&](const std::vector<Plain<T>>& inverse) {
    for (int row = 0; row < block.size(); ++row) {
      const T D = state.diagonal[row];
      state.diagonal[row] = select(inverse[row] > Plain<T>(0.0), D, T(beyond_all));
    }
  };
  if (block.condensation) {
    give_way(inverse_pivots_of_rigid(numbers_of_block(block, state, 0), block.loop_pivot));
  } else {
    factor_sparse(block, kernels, state, 0);
    give_way(state.at(0).factor.inverse);
  }
  load_coordinates(s.scene, block, s.q, state.x[0]);
}

}  // namespace sheetbend
