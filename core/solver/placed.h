// An element gathered from a substep's state, with where its numbers stand.
#pragma once

#include "core/constraints/registry.h"
#include "core/element/element.h"
#include "core/scene/scene.h"

namespace sheetbend {

// What one substep works on. Per-constraint arrays are in the scene's order, per-row arrays in the order of the multipliers.
template <class T>
struct SubstepState {
  const Scene& scene;
  Inputs<const T> inputs;
  double eta;
  T* q;          // coordinates, being corrected
  const T* w;    // effective inverse mass per node; 0 for pinned and driven
  const T* C_r;  // reference values of damped rows
  T* lambda;     // multipliers, reset at the substep's start
};

template <class K, class T>
struct Placed : Element<K, T> {
  const int* nodes;
  int first_row;

  // The coordinates come from a record where one is given, otherwise from the state.
  Placed(const SubstepState<T>& s, const Group& group, int item, const T* recorded = nullptr)
      : nodes(group.stencil.data() + static_cast<std::size_t>(item) * K::arity),
        first_row(group.first_row + item * K::rows) {
    constexpr int P = parameter_count<K>;
    const T* p = s.inputs.of(Quantity::rest) + group.first_value + static_cast<std::size_t>(item) * P;
    for (int k = 0; k < P; ++k) this->p[k] = p[k];
    this->rates = Rates<T>(s.inputs.of(Quantity::compliance)[group.first + item],
                           group.damped ? s.inputs.of(Quantity::damping)[group.first + item] : T(0.0), s.eta);
    for (int k = 0; k < K::arity; ++k) {
      this->w[k] = s.w[nodes[k]];
      const T* from = recorded ? recorded + 3 * k : s.q + s.scene.first_dof[nodes[k]];
      for (int d = 0; d < 3; ++d) this->x[3 * k + d] = from[d];
    }
    if constexpr (K::unit_gradients) {
      T sum = this->w[0];
      for (int k = 1; k < K::arity; ++k) sum += this->w[k];
      this->inverse = inverse_of_unit_matrix(sum, this->rates);
    }
  }

  const T* references(const SubstepState<T>& s, const Group& group) const {
    return group.damped ? s.C_r + first_row : nullptr;
  }
};

}  // namespace sheetbend
