// The reverse of the block projection over a substep's state: a color of single constraints, or a direct block. The mathematics is
// element_vjp.h's; here numbers are gathered and cotangents put where they belong.
#pragma once

#include "adjoint/element/element_vjp.h"
#include "adjoint/element/rates_vjp.h"
#include "core/solver/substep.h"

namespace sheetbend {

// Cotangents during the reverse of one substep.
template <class T>
struct SubstepCotangent {
  T* x;       // of the coordinates
  T* fixed;   // of pinned and driven nodes, kept per stencil (constraints of one color may share such a node)
  T* lambda;  // of the multipliers
  T* w;       // of the effective inverse masses, accumulated
  T* C_r;     // of the damping references, accumulated
  Inputs<T> inputs;
};

// Block-wide vectors of one reverse: z = x'_bar - J^T y and u = J^T dl.
template <class T>
struct BlockVectors {
  T *z, *u;
};

// Adds an element's cotangents to those of the multipliers, references and inputs.
template <class K, class T>
void add_element(const SubstepState<T>& s, const Group& group, int item, const ElementCotangent<K, T>& own,
                 const SubstepCotangent<T>& bar) {
  const int first_row = group.first_row + item * K::rows;
  for (int j = 0; j < K::rows; ++j) {
    bar.lambda[first_row + j] += own.lambda[j];
    if (group.damped) bar.C_r[first_row + j] += own.C_r[j];
  }
  constexpr int P = parameter_count<K>;
  for (int k = 0; k < P; ++k)
    bar.inputs.of(Quantity::rest)[group.first_value + static_cast<std::size_t>(item) * P + k] += own.p[k];
  add_rates(s.inputs, group, item, s.eta, own.a, own.g, bar.inputs);
}

// Adds a stencil's cotangent to where it belongs.
template <class K, class T>
void add_cotangent(const SubstepState<T>& s, const Placed<K, T>& e, std::size_t coordinate, const T* local,
                   const SubstepCotangent<T>& bar) {
  for (int k = 0; k < K::arity; ++k) {
    T* to =
        s.scene.role[e.nodes[k]] == Role::free ? bar.x + s.scene.first_dof[e.nodes[k]] : bar.fixed + coordinate + 3 * k;
    for (int d = 0; d < 3; ++d) to[d] += local[3 * k + d];
  }
}

// Gathers a per-dof vector on the stencil; zero where nothing can move.
template <class K, class T>
void gather_free(const SubstepState<T>& s, const Placed<K, T>& e, const T* from, T* local) {
  for (int d = 0; d < K::dofs; ++d)
    local[d] = s.scene.role[e.nodes[d / 3]] == Role::free ? from[s.scene.first_dof[e.nodes[d / 3]] + d % 3] : T(0.0);
}

template <class T>
void project_color_vjp(const SubstepState<T>& s, const SolverOptions& options, const Color& color,
                       const IterationRecord<T>& record, const SubstepCotangent<T>& bar) {
  const Group& group = s.scene.groups[color.group];
  with_kind(group.kind, [&]<class K>(K) {
    parallel_for(static_cast<int>(color.items.size()), options.threads, options.grain, [&](int begin, int end) {
      for (int n = begin; n < end; ++n) {
        const int item = color.items[n];
        const std::size_t coordinate = first_coordinate<K>(group, item);
        const Placed<K, T> e(s, group, item, &record.x[coordinate]);
        T x_bar[K::dofs], w_bar[K::arity];
        ElementCotangent<K, T> own;
        gather_free(s, e, bar.x, x_bar);
        correction_vjp(e, Kept<K, T>(e.x), &record.lambda[e.first_row], e.references(s, group), &record.dl[e.first_row],
                       bar.lambda + e.first_row, x_bar, w_bar, own);
        for (int k = 0; k < K::arity; ++k)
          if (s.scene.role[e.nodes[k]] == Role::free) bar.w[e.nodes[k]] += w_bar[k];
        add_element(s, group, item, own, bar);
        add_cotangent(s, e, coordinate, x_bar, bar);
      }
    });
  });
}

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
    T z[K::dofs], u[K::dofs], v[K::rows * K::dofs], x_bar[K::dofs]{};
    gather_free(s, e, block_wide.z, z);
    gather_free(s, e, block_wide.u, u);
    ElementCotangent<K, T> own;
    directions(e, &record.dl[e.first_row], y + m.first_row, z, u, v);
    pull_back<K>(e, Kept<K, T>(e.x), &record.lambda[e.first_row], e.references(s, group), &record.dl[e.first_row],
                 y + m.first_row, v, u, x_bar, own);
    add_element(s, group, m.item, own, bar);
    add_cotangent(s, e, first_coordinate<K>(group, m.item), x_bar, bar);
  });
}

}  // namespace sheetbend
