// The reverse of the block projection of a direct block. The mathematics is element_vjp.h's, with the block's own factors.
#pragma once

#include "adjoint/project_vjp.h"
#include "core/solver/project_block.h"

namespace sheetbend {

// Block-wide vectors of one reverse: z = x'_bar - J^T y and u = J^T dl.
template <class T>
struct BlockVectors {
  T *z, *u;
};

// The block touches its own movable nodes of z and u only.
template <class T>
void project_block_vjp(const SubstepState<T>& s, const DirectBlock& block, const IterationRecord<T>& record,
                       const Factor<T>& factor, T* rows, const BlockVectors<T>& block_wide,
                       const SubstepCotangent<T>& bar) {
  T* y = rows + block.first_row;
  const auto for_each_member = [&](auto&& body) {
    for (const Member& m : block.members) {
      const Group& group = s.scene.groups[m.group];
      with_kind(group.kind, [&]<class K>(K) {
        const Placed<K, T> e(s, group, m.item, &record.x[first_coordinate<K>(group, m.item)]);
        body(e, &record.J[first_gradient<K>(group, m.item)], group, m);
      });
    }
  };
  for_each_member([&]<class K>(const Placed<K, T>& e, const T* J, const Group&, const Member& m) {
    T x_bar[K::dofs];
    gather_free(s, e, bar.x, x_bar);
    adjoint_right_side<K, T>(e, J, bar.lambda + e.first_row, x_bar, y + m.first_row);
  });
  factor.solve(block.structure, y);
  for (const int node : block.nodes) std::fill_n(block_wide.u + s.scene.first_dof[node], 3, T(0.0));
  for_each_member([&]<class K>(const Placed<K, T>& e, const T* J, const Group& group, const Member& m) {
    T u[K::dofs]{}, back[K::dofs]{};
    transpose_times<K>(J, &record.dl[e.first_row], u);
    transpose_times<K>(J, y + m.first_row, back);
    for (int d = 0; d < K::dofs; ++d) back[d] = -back[d];
    for (int d = 0; d < K::dofs; ++d)
      if (s.scene.role[e.nodes[d / 3]] == Role::free) block_wide.u[s.scene.first_dof[e.nodes[d / 3]] + d % 3] += u[d];
    add_cotangent(s, e, first_coordinate<K>(group, m.item), back, bar);
  });
  for (const int node : block.nodes) {
    const int dof = s.scene.first_dof[node];
    std::copy_n(bar.x + dof, 3, block_wide.z + dof);
    bar.w[node] += dot(Vec3<T>(block_wide.u + dof), Vec3<T>(block_wide.z + dof));
  }
  for_each_member([&]<class K>(const Placed<K, T>& e, const T*, const Group& group, const Member& m) {
    T z[K::dofs], u[K::dofs], x_bar[K::dofs]{};
    gather_free(s, e, block_wide.z, z);
    gather_free(s, e, block_wide.u, u);
    ElementCotangent<K, T> own;
    pull_back<false, K, T>(e, Kept<K, T>(e.x), &record.lambda[e.first_row], e.references(s, group), &record.dl[e.first_row],
                 y + m.first_row, z, u, x_bar, own);
    add_element(s, group, m.item, own, bar);
    add_cotangent(s, e, first_coordinate<K>(group, m.item), x_bar, bar);
  });
}

}  // namespace sheetbend
