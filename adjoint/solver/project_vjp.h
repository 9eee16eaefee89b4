// The reverse of the block projection over a substep's state, for a color of single constraints (project_block_vjp.h is for a direct
// block). The mathematics is element_vjp.h's; here numbers are gathered and cotangents put where they belong.
#pragma once

#include "adjoint/element/any_kind_vjp.h"
#include "adjoint/element/constraint_vjp.h"
#include "adjoint/element/element_vjp.h"
#include "adjoint/element/rates_vjp.h"
#include "adjoint/solver/cotangents.h"
#include "core/solver/project.h"

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

// Reverse of damping_references().
template <class T>
void damping_references_vjp(const Scene& scene, const Inputs<const T>& in, const Bdf& bdf, const SubstepStates<T>& s,
                            const T* C_r_bar, const StateCotangents<T>& bar, const Inputs<T>& in_bar) {
  T x[largest_kind.dofs], scaled[largest_kind.rows], by[largest_kind.dofs];
  const auto pull_back = [&](const Group& group, int item, const T* at, const T* C_bar, const T& scale, T* x_bar) {
    const auto nodes = group.nodes(item);
    const int dofs = 3 * group.arity;
    const std::size_t value = group.first_value + static_cast<std::size_t>(item) * group.parameters;
    for (int d = 0; d < dofs; ++d) x[d] = at[scene.first_dof[nodes[d / 3]] + d % 3];
    for (int j = 0; j < group.rows; ++j) scaled[j] = scale * C_bar[j];
    std::fill_n(by, dofs, T(0.0));
    values_vjp(group.kind, x, in.of(Quantity::rest) + value, scaled, by, in_bar.of(Quantity::rest) + value);
    for (int d = 0; d < dofs; ++d) x_bar[scene.first_dof[nodes[d / 3]] + d % 3] += by[d];
  };
  for (const Group& group : scene.groups) {
    if (!group.damped) continue;
    for (int i = 0; i < group.count; ++i) {
      const T* C_bar = C_r_bar + group.first_row + i * group.rows;
      pull_back(group, i, s.x, C_bar, T(1.0 - bdf.before), bar.x);
      if (bdf.before != 0.0) pull_back(group, i, s.x_before, C_bar, T(bdf.before), bar.x_before);
    }
  }
}

}  // namespace sheetbend
