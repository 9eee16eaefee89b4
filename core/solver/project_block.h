// The block projection of a direct block, forward: the kernels of core/blocks do the work, here they get their arrays (block_state.h).
#pragma once

#include <utility>

#include "core/blocks/block_forward.h"
#include "core/blocks/every_kind.h"
#include "core/solver/block_state.h"
#include "core/solver/block_tangents.h"

namespace sheetbend {

template <class T>
inline constexpr bool has_compiled_kernels = std::is_same_v<T, double> || std::is_same_v<T, Pack>;

// The set for T: of this machine's instruction set for numbers and lanes, otherwise compiled where it is used.
template <class T>
const sheetbend_blocks::Forward& forward_kernels(const sheetbend_packs::KernelTable& kernels) {
  if constexpr (has_compiled_kernels<T>)
    return (std::is_same_v<T, Pack> ? kernels.blocks->many : kernels.blocks->one).forward;
  else
    return ForwardKernels<T, ForwardOfEveryKind<T>>::all;
}

// The runs of a block; the reverse gives cotangents for their values. They stand in the state, so that a substep allocates nothing.
template <class T>
const std::vector<sheetbend_blocks::Run>& runs_of(const SubstepState<T>& s, const DirectBlock& block,
                                                  BlockState<T>& state, std::vector<Numbers<T>>* values_bar = nullptr) {
  state.runs.clear();
  for (std::size_t r = 0; r < block.runs.size(); ++r) {
    const MemberRun& run = block.runs[r];
    const Group& group = s.scene.groups[run.group];
    state.runs.push_back({group.kind, run.count, group.damped, run.nodes.data(), run.gradients.data(),
                          run.first_row.data(), state.values[r].numbers(),
                          values_bar ? (*values_bar)[r].numbers() : nullptr});
  }
  return state.runs;
}

template <class T>
sheetbend_blocks::Values values_at(const std::vector<sheetbend_blocks::Run>& runs,
                                   typename BlockState<T>::Values& state) {
  sheetbend_blocks::Values v{};
  v.runs = runs.data();
  v.run_count = static_cast<int>(runs.size());
  v.x = state.x.numbers();
  v.C = state.C.numbers();
  return v;
}

// The arrays of one iteration; those of the reverse are left open.
template <class T>
sheetbend_blocks::Block arrays_of(const DirectBlock& block, const std::vector<sheetbend_blocks::Run>& runs,
                                  BlockState<T>& state, int iteration) {
  auto& own = state.at(iteration);
  sheetbend_blocks::Block b{};
  b.runs = runs.data();
  b.run_count = static_cast<int>(runs.size());
  b.movable = block.movable;
  b.particles = static_cast<int>(block.particles.size());
  b.size = block.size();
  b.band = block.structure.stored_band();
  b.window = block.window.data();
  b.rows = block.window_rows.data();
  b.x = state.at(state.x, iteration).numbers();
  b.x_next = state.at(state.x, iteration + 1).numbers();
  b.lambda = state.at(state.lambda, iteration).numbers();
  b.lambda_next = state.at(state.lambda, iteration + 1).numbers();
  b.C_r = state.C_r.numbers();
  b.diagonal = state.diagonal.numbers();
  b.gradients = own.gradients.numbers();
  b.matrix = reinterpret_cast<double*>(own.factor.values.data());
  b.inverse = reinterpret_cast<double*>(own.factor.inverse.data());
  b.dl = own.dl.numbers();
  b.u = own.u.numbers();
  return b;
}

// Fills and factors the matrix of a block with branches or loops.
template <class T>
void factor_sparse(const DirectBlock& block, const sheetbend_blocks::Forward& kernels, BlockState<T>& state,
                   int iteration) {
  auto& own = state.at(iteration);
  own.factor.reset(block.structure);
  for (int row = 0; row < block.size(); ++row)
    own.factor.values[block.structure.position(row, row)] = state.diagonal.data()[row];
  const Plain<T>*G = own.gradients.data(), *x = state.at(state.x, iteration).data();
  auto position = block.positions.begin();
  for (int p = 0; p < block.movable; ++p)
    for (int i = block.window[p]; i < block.window[p + 1]; ++i) {
      const Vec3<Plain<T>> wG = x[sheetbend_blocks::row * p + 3] * Vec3<Plain<T>>(G + sheetbend_blocks::row * i);
      for (int k = block.window[p]; k <= i; ++k)
        own.factor.values[*position++] += dot(wG, Vec3<Plain<T>>(G + sheetbend_blocks::row * k));
    }
  own.factor.factorize(block.structure, kernels.factor_supernodes);
}

// The numbers that a condensed block is prepared and solved from.
template <class T>
BlockNumbers<Plain<T>> numbers_of_block(const DirectBlock& block, BlockState<T>& state, int iteration) {
  return {state.at(iteration).gradients.data(),
          state.at(state.x, iteration).data(),
          state.diagonal.data(),
          block.window.data(),
          block.window_rows.data(),
          block.movable,
          block.size(),
          static_cast<int>(block.volumes.size())};
}

// b = A^-1 b for blocks that are no band, factored or prepared before.
template <class T, class U>
void solve_sparse(const DirectBlock& block, BlockState<T>& state, int iteration, U* b) {
  auto& own = state.at(iteration);
  if (block.condensation)
    own.condensed.solve(*block.condensation, numbers_of_block(block, state, iteration), b);
  else
    own.factor.solve(block.structure, b);
}

// The damping references; `before` is that of Bdf. One of the two states was looked at in the substep before, or in the one after on the way back.
template <class T>
void damping_references(const SubstepState<T>& s, const DirectBlock& block, const sheetbend_packs::KernelTable& table,
                        double before, const SubstepStates<T>& states, BlockState<T>& state) {
  if (!block.damped) return;
  const auto& runs = runs_of(s, block, state);
  const auto find = [&](typename BlockState<T>::Values& values, const T* at, int step) {
    if (step >= 0 && values.step == step) return;
    values.step = step;
    load_coordinates(s.scene, block, at, values.x);
    forward_kernels<Plain<T>>(table).values(values_at<T>(runs, values));
    if constexpr (carries_tangents<T>)
      values_tangents(values_at<T>(runs, values), table.blocks->tangents, state, values);
  };
  const int n = states.step;
  if (n >= 0 && (state.now.step == n - 1 || state.before.step == n)) std::swap(state.now, state.before);
  find(state.now, states.x, n);
  if (before != 0.0) find(state.before, states.x_before, n - 1);

  const sheetbend_blocks::References references{
      runs.data(),           static_cast<int>(runs.size()), before,
      state.now.C.numbers(), state.before.C.numbers(),      state.C_r.numbers()};
  forward_kernels<Plain<T>>(table).refer(references);
  if constexpr (carries_tangents<T>) refer_tangents(references, block.size(), table.blocks->tangents, state);
}

template <class T>
void project_block(const SubstepState<T>& s, const DirectBlock& block, const sheetbend_packs::KernelTable& table,
                   BlockState<T>& state, int iteration) {
  const auto& kernels = forward_kernels<Plain<T>>(table);
  const auto& runs = runs_of(s, block, state);
  const auto arrays = arrays_of(block, runs, state, iteration);
  kernels.evaluate(arrays);
  evaluate_volumes(s.scene, s.inputs, block, state, iteration);
  if (block.banded()) {
    kernels.factor(arrays);
    kernels.solve(arrays, arrays.dl);
  } else {
    if (block.condensation)
      state.at(iteration).condensed.prepare(*block.condensation, numbers_of_block(block, state, iteration),
                                            kernels.factor_supernodes);
    else
      factor_sparse(block, kernels, state, iteration);
    solve_sparse(block, state, iteration, state.at(iteration).dl.data());
  }
  if constexpr (carries_tangents<T>)
    project_tangents(block, table.blocks->tangents, arrays, state, iteration,
                     [&](Pack* b) { solve_sparse(block, state, iteration, b); });
  kernels.push(arrays);
}

}  // namespace sheetbend
