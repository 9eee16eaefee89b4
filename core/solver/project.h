// The block projection, forward:  A dl = -s/(1+g),  x' = x + W J^T dl,  lambda' = lambda + dl.
// Once for a color of blocks of one, once for a direct block; both go through Element.
#pragma once

#include "core/solver/element.h"
#include "core/solver/plan.h"
#include "core/solver/small_ldlt.h"
#include "core/threads/pool.h"

namespace sheetbend {

// What the reverse needs of one iteration: coordinates and multipliers before each projection, the correction, and direct factors.
template <class T>
struct IterationRecord {
  std::vector<T> x, lambda, dl;
  std::vector<Factor<T>> factors;

  void resize(const Scene& scene, const Plan& plan) {
    x.resize(scene.stencil_coordinates);
    lambda.resize(scene.rows);
    dl.resize(scene.rows);
    factors.resize(plan.blocks.size());
  }
};

template <class T>
struct Scratch {
  std::vector<T> J, rows;  // all constraints' gradients; one number per row, block by block
  void resize(const Scene& scene) {
    J.resize(scene.gradient_entries);
    rows.resize(scene.rows);
  }
};

// x' = x + W J^T dl on one stencil. Fixed nodes are not written at all: constraints that run in parallel may share them.
template <class K, class T>
void apply(const SubstepState<T>& s, const Element<K, T>& e, const T* J, const T* dl) {
  T push[K::dofs]{};
  transpose_times<K>(J, dl, push);
  for (int k = 0; k < K::arity; ++k) {
    if (s.scene.role[e.nodes[k]] != Role::free) continue;
    for (int d = 0; d < 3; ++d) s.q[s.scene.first_dof[e.nodes[k]] + d] += e.w[k] * push[3 * k + d];
  }
}

template <class T>
void project_color(const SubstepState<T>& s, const SolverOptions& options, const Color& color, IterationRecord<T>& record) {
  const Group& group = s.scene.groups[color.group];
  with_kind(group.kind, [&]<class K>(K) {
    parallel_for(static_cast<int>(color.items.size()), options.threads, options.grain, [&](int begin, int end) {
      for (int n = begin; n < end; ++n) {
        const int item = color.items[n];
        const Element<K, T> e(s, group, item);
        const Evaluation<K, T> value(e.x, e.p);
        T A[K::rows * K::rows], dl[K::rows];
        e.matrix(value.J, A);
        for (int j = 0; j < K::rows; ++j) dl[j] = -(e.residual(s, group.damped, value.C, j) / (T(1.0) + e.rates.g));
        SmallLdlt<K::rows, T>(A).solve(dl);
        std::copy_n(e.x, K::dofs, &record.x[group.first_coordinate + static_cast<std::size_t>(item) * K::dofs]);
        for (int j = 0; j < K::rows; ++j) {
          record.lambda[e.first_row + j] = s.lambda[e.first_row + j];
          record.dl[e.first_row + j] = dl[j];
          s.lambda[e.first_row + j] += dl[j];
        }
        apply<K>(s, e, value.J, dl);
      }
    });
  });
}

// Fills the block's matrix from the gradients of all its members.
template <class T>
void assemble(const SubstepState<T>& s, const DirectBlock& block, const T* J, Factor<T>& factor) {
  for (const Coupling& c : block.couplings) {
    const Member &row = block.members[c.row_member], &column = block.members[c.column_member];
    const Group &row_group = s.scene.groups[row.group], &column_group = s.scene.groups[column.group];
    const int row_dofs = 3 * row_group.arity, column_dofs = 3 * column_group.arity;
    const T* Ji = J + row_group.first_gradient + static_cast<std::size_t>(row.item) * row_group.rows * row_dofs + 3 * c.row_slot;
    const T* Jk = J + column_group.first_gradient + static_cast<std::size_t>(column.item) * column_group.rows * column_dofs + 3 * c.column_slot;
    const T& w = s.w[c.node];
    const int* position = &block.position[c.first_position];
    for (int i = 0; i < row_group.rows; ++i)
      for (int k = 0; k < column_group.rows; ++k, ++position) {
        if (*position < 0) continue;
        const T *a = Ji + i * row_dofs, *b = Jk + k * column_dofs;
        factor.values[*position] += w * (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
      }
  }
}

template <class T>
void project_block(const SubstepState<T>& s, const DirectBlock& block, Scratch<T>& scratch, IterationRecord<T>& record,
                   Factor<T>& factor) {
  std::vector<T>& J = scratch.J;
  T* solution = scratch.rows.data() + block.first_row;
  factor.reset(block.structure);
  for (const Member& m : block.members) {
    const Group& group = s.scene.groups[m.group];
    with_kind(group.kind, [&]<class K>(K) {
      const Element<K, T> e(s, group, m.item);
      T C[K::rows], *Je = &J[group.first_gradient + static_cast<std::size_t>(m.item) * K::rows * K::dofs];
      K::evaluate(e.x, e.p, C, Je);
      for (int j = 0; j < K::rows; ++j) {
        solution[m.first_row + j] = -(e.residual(s, group.damped, C, j) / (T(1.0) + e.rates.g));
        factor.values[block.structure.position(m.first_row + j, m.first_row + j)] += e.rates.a / (T(1.0) + e.rates.g);
      }
      std::copy_n(e.x, K::dofs, &record.x[group.first_coordinate + static_cast<std::size_t>(m.item) * K::dofs]);
    });
  }
  assemble(s, block, J.data(), factor);
  factor.factorize(block.structure);
  factor.solve(block.structure, solution);
  for (const Member& m : block.members) {
    const Group& group = s.scene.groups[m.group];
    with_kind(group.kind, [&]<class K>(K) {
      const Element<K, T> e(s, group, m.item);
      const T* dl_e = &solution[m.first_row];
      for (int j = 0; j < K::rows; ++j) {
        record.lambda[e.first_row + j] = s.lambda[e.first_row + j];
        record.dl[e.first_row + j] = dl_e[j];
        s.lambda[e.first_row + j] += dl_e[j];
      }
      apply<K>(s, e, &J[group.first_gradient + static_cast<std::size_t>(m.item) * K::rows * K::dofs], dl_e);
    });
  }
}

}  // namespace sheetbend
