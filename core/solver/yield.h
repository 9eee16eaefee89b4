// Yield at the end of a substep: where the sliding spring's own curvature e = C - (1 - share) set is longer than y, its set follows,
//
//   set' = set + f e,   f = max(0, 1 - y/|e|)        (return mapping of a circular yield surface: Simo & Hughes 1998, sec. 3.3)
//
// evaluated at the state that the substep has found. The branch is taken by the values alone, so the reverse repeats it.
#pragma once

#include "core/constraints/registry.h"
#include "core/scene/scene.h"

namespace sheetbend {

template <class K, class T>
struct Yield {
  static constexpr int set = K::dofs - 3;
  T x[K::dofs], C[K::rows], J[K::rows * K::dofs], e[K::rows];
  T f, y_over_length, inverse_length;

  Yield(const Scene& scene, const Group& group, int item, const T* p, const T* state) {
    const auto nodes = group.nodes(item);
    for (int d = 0; d < K::dofs; ++d) x[d] = state[scene.first_dof[nodes[d / 3]] + d % 3];
    K::evaluate(x, p, C, J);
    const T one(1.0), y = p[K::yield_parameter];
    T length2(0.0);
    for (int j = 0; j < K::rows; ++j) {
      e[j] = C[j] - (one - p[K::share_parameter]) * x[set + j];
      length2 += e[j] * e[j];
    }
    const auto slides = length2 > y * y;
    inverse_length = select(slides, one / sqrt(select(slides, length2, one)), T(0.0));
    y_over_length = y * inverse_length;
    f = select(slides, one - y_over_length, T(0.0));
  }
};

// Calls f(K{}, group, item, parameters' place) for every constraint that yields.
template <class F>
void for_each_yielding(const Scene& scene, F&& f) {
  for (const Group& group : scene.groups)
    with_kind(group.kind, [&]<class K>(K kind) {
      if constexpr (Yields<K>)
        for (int i = 0; i < group.count; ++i)
          f(kind, group, i, group.first_value + static_cast<std::size_t>(i) * parameter_count<K>);
    });
}

template <class T>
void yield(const Scene& scene, const Inputs<const T>& in, T* state) {
  if (!scene.yields) return;
  for_each_yielding(scene, [&]<class K>(K, const Group& group, int item, std::size_t value) {
    const Yield<K, T> at(scene, group, item, in.of(Quantity::rest) + value, state);
    T* set = state + scene.first_dof[group.nodes(item)[K::arity - 1]];
    for (int j = 0; j < K::rows; ++j) set[j] += at.f * at.e[j];
  });
}

}  // namespace sheetbend
