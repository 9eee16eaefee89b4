// The block projection of a direct block, forward: its matrix is filled from all members' gradients, factored and solved.
#pragma once

#include "core/solver/project.h"

namespace sheetbend {

// All constraints' J of a direct block stand in one array, constraint by constraint.
template <class K>
std::size_t first_gradient(const Group& group, int item) {
  return group.first_gradient + static_cast<std::size_t>(item) * K::rows * K::dofs;
}

// Calls f with n as a constant, 1 <= n <= Max.
template <int Max, class F>
void with_size(int n, F&& f) {
  if constexpr (Max > 1)
    if (n < Max) return with_size<Max - 1>(n, f);
  f.template operator()<Max>();
}

// values[position] += w a b^T on one node, for rows x columns scalar constraints (sizes known, so that the loops unroll).
template <int Rows, int Columns, class T>
void add_coupling(const T& w, const T* a, int a_stride, const T* b, int b_stride, const int* position, T* values) {
  for (int i = 0; i < Rows; ++i) {
    const T x = w * a[i * a_stride], y = w * a[i * a_stride + 1], z = w * a[i * a_stride + 2];
    for (int k = 0; k < Columns; ++k) {
      const T* bk = b + k * b_stride;
      if (const int at = position[i * Columns + k]; at >= 0) values[at] += x * bk[0] + y * bk[1] + z * bk[2];
    }
  }
}

// Fills the block's matrix from the gradients of all its members.
template <class T>
void assemble(const SubstepState<T>& s, const DirectBlock& block, const T* J, Factor<T>& factor) {
  const auto gradient = [&](const Member& m, int slot, int& stride) {
    const Group& group = s.scene.groups[m.group];
    stride = 3 * group.arity;
    return J + group.first_gradient + static_cast<std::size_t>(m.item) * group.rows * stride + 3 * slot;
  };
  for (const Coupling& c : block.couplings) {
    int row_stride, column_stride;
    const Member &row = block.members[c.row_member], &column = block.members[c.column_member];
    const T *a = gradient(row, c.row_slot, row_stride), *b = gradient(column, c.column_slot, column_stride);
    with_size<max_rows>(s.scene.groups[row.group].rows, [&]<int R>() {
      with_size<max_rows>(s.scene.groups[column.group].rows, [&]<int C>() {
        add_coupling<R, C>(s.w[c.node], a, row_stride, b, column_stride, &block.position[c.first_position],
                           factor.values.data());
      });
    });
  }
}

template <class T>
void project_block(const SubstepState<T>& s, const DirectBlock& block, T* rows, IterationRecord<T>& record,
                   Factor<T>& factor) {
  T* solution = rows + block.first_row;
  factor.reset(block.structure);
  for (const Member& m : block.members) {
    const Group& group = s.scene.groups[m.group];
    with_kind(group.kind, [&]<class K>(K) {
      const Placed<K, T> e(s, group, m.item);
      T C[K::rows];
      K::evaluate(e.x, e.p, C, &record.J[first_gradient<K>(group, m.item)]);
      for (int j = 0; j < K::rows; ++j) {
        solution[m.first_row + j] = -(e.residual(C, s.lambda + e.first_row, e.references(s, group), j) * e.rates.scale);
        factor.values[block.structure.position(m.first_row + j, m.first_row + j)] += e.rates.a * e.rates.scale;
      }
      std::copy_n(e.x, K::dofs, &record.x[first_coordinate<K>(group, m.item)]);
    });
  }
  assemble(s, block, record.J.data(), factor);
  factor.factorize(block.structure);
  factor.solve(block.structure, solution);
  for (const Member& m : block.members) {
    const Group& group = s.scene.groups[m.group];
    with_kind(group.kind, [&]<class K>(K) {
      const Placed<K, T> e(s, group, m.item);
      T push[K::dofs]{};
      transpose_times<K>(&record.J[first_gradient<K>(group, m.item)], &solution[m.first_row], push);
      correct_multipliers(s, e, &solution[m.first_row], record);
      apply(s, e, push);
    });
  }
}

}  // namespace sheetbend
