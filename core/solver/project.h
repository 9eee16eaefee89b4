// The block projection, forward:  A dl = -s/(1+g),  x' = x + W J^T dl,  lambda' = lambda + dl.
// Here for a color of blocks of one; project_block.h is for a direct block. Both go through Element.
#pragma once

#include "core/constraints/any_kind.h"
#include "core/solver/placed.h"
#include "core/solver/plan.h"
#include "core/solver/states.h"
#include "core/threads/pool.h"

namespace sheetbend {

// What the reverse needs of one iteration over the colors: coordinates and multipliers before each projection, and the correction.
template <class T>
struct IterationRecord {
  std::vector<T> x, lambda, dl;

  void resize(const Scene& scene) {
    x.resize(scene.stencil_coordinates);
    lambda.resize(scene.rows);
    dl.resize(scene.rows);
  }
  static std::size_t bytes(const Scene& scene) { return sizeof(T) * (scene.stencil_coordinates + 2 * scene.rows); }
};

// C_r = C(x_n) for BDF1, (4 C(x_n) - C(x_{n-1}))/3 for BDF2 (angles kept on one branch).
template <class T>
void damping_references(const Scene& scene, const Inputs<const T>& in, const Bdf& bdf, const SubstepStates<T>& s,
                        T* C_r) {
  T x[largest_kind.dofs], before[largest_kind.rows];
  for (const Group& group : scene.groups) {
    if (!group.damped) continue;
    const AnyKind<T>& kind = any_kind<T>(group.kind);
    for (int i = 0; i < group.count; ++i) {
      const auto nodes = group.nodes(i);
      const T* p = in.of(Quantity::rest) + group.first_value + static_cast<std::size_t>(i) * group.parameters;
      const auto find_values = [&](const T* state, T* C) {
        for (int d = 0; d < kind.dofs; ++d) x[d] = state[scene.first_dof[nodes[d / 3]] + d % 3];
        kind.values(x, p, C);
      };
      T* C = C_r + group.first_row + i * kind.rows;
      find_values(s.x, C);
      if (bdf.before == 0.0) continue;
      find_values(s.x_before, before);
      for (int j = 0; j < kind.rows; ++j) C[j] = C[j] - T(bdf.before) * kind.difference(C[j], before[j]);
    }
  }
}

// The same for plain numbers, compiled per kind: through tables, damped sweeps would take a sixth longer forward. Other scalars gain by them.
inline void damping_references(const Scene& scene, const Inputs<const double>& in, const Bdf& bdf,
                               const SubstepStates<double>& s, double* C_r) {
  for (const Group& group : scene.groups) {
    if (!group.damped) continue;
    with_kind(group.kind, [&]<class K>(K) {
      for (int i = 0; i < group.count; ++i) {
        double x[K::dofs], x_before[K::dofs];
        const int* nodes = group.stencil.data() + static_cast<std::size_t>(i) * K::arity;
        for (int k = 0; k < K::arity; ++k) {
          std::copy_n(s.x + scene.first_dof[nodes[k]], 3, x + 3 * k);
          std::copy_n(s.x_before + scene.first_dof[nodes[k]], 3, x_before + 3 * k);
        }
        const double* p = in.of(Quantity::rest) + group.first_value + static_cast<std::size_t>(i) * parameter_count<K>;
        const Evaluation<K, double> now(x, p), before(x_before, p);
        for (int j = 0; j < K::rows; ++j)
          C_r[group.first_row + i * K::rows + j] =
              bdf.before == 0.0 ? now.C[j] : now.C[j] - bdf.before * difference<K>(now.C[j], before.C[j]);
      }
    });
  }
}

// x' = x + W push on one stencil. Fixed nodes are not written at all: constraints that run in parallel may share them.
template <class K, class T>
void apply(const SubstepState<T>& s, const Placed<K, T>& e, const T* push) {
  for (int k = 0; k < K::arity; ++k) {
    if (s.scene.role[e.nodes[k]] != Role::free) continue;
    for (int d = 0; d < 3; ++d) s.q[s.scene.first_dof[e.nodes[k]] + d] += e.w[k] * push[3 * k + d];
  }
}

// lambda' = lambda + dl, and what the reverse needs of it.
template <class K, class T>
void correct_multipliers(const SubstepState<T>& s, const Placed<K, T>& e, const T* dl, IterationRecord<T>& record) {
  for (int row = e.first_row, j = 0; j < K::rows; ++row, ++j) {
    record.lambda[row] = s.lambda[row];
    record.dl[row] = dl[j];
    s.lambda[row] += dl[j];
  }
}

template <class K>
std::size_t first_coordinate(const Group& group, int item) {
  return group.first_coordinate + static_cast<std::size_t>(item) * K::dofs;
}

template <class T>
void project_color(const SubstepState<T>& s, const SolverOptions& options, const Color& color,
                   IterationRecord<T>& record) {
  const Group& group = s.scene.groups[color.group];
  with_kind(group.kind, [&]<class K>(K) {
    parallel_for(static_cast<int>(color.items.size()), options.threads, options.grain, [&](int begin, int end) {
      for (int n = begin; n < end; ++n) {
        const int item = color.items[n];
        const Placed<K, T> e(s, group, item);
        const Correction<K, T> correction(e, {e.x, e.p}, s.lambda + e.first_row, e.references(s, group));
        std::copy_n(e.x, K::dofs, &record.x[first_coordinate<K>(group, item)]);
        correct_multipliers(s, e, correction.dl, record);
        apply(s, e, correction.push);
      }
    });
  });
}

}  // namespace sheetbend
