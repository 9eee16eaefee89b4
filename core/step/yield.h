// Yield at the end of a substep: where the sliding spring is strained by e longer than y, its set follows,
//
//   set' = set + f e,   f = max(0, 1 - y/|e|)        (return mapping of a circular yield surface: Simo & Hughes 1998, sec. 3.3)
//
// e = C - (1 - share) set for a kind with a spring beside it (yielding_curvature.h), of which the deviator where shape alone yields
// (yielding_solid_strain.h), or some rows (yielding_strain.h); otherwise C of the kind's Slider (friction_hinge.h);
// evaluated at the state that the substep has found. The branch is taken by the values alone, so the reverse repeats it.
#pragma once

#include "core/constraints/registry.h"
#include "core/scalar/dual.h"
#include "core/scene/scene.h"
#include "core/step/stages.h"

namespace sheetbend {

// What the strain of the sliding spring is made from: the kind itself, or its Slider, with the same stencil and parameters.
template <class K>
struct SliderOf {
  using type = K;
};
template <class K>
  requires requires { typename K::Slider; }
struct SliderOf<K> {
  using type = typename K::Slider;
};
template <class K>
using Slider = typename SliderOf<K>::type;

// Whether a spring stands beside the sliding one and takes part of the load.
template <class K>
inline constexpr bool shares_load = requires { K::share_parameter; };

// Leaves what of a strain can slide: the deviator, where the kind yields in shape alone and the first three rows are the normal ones, or the rows from
// first_sliding on. A projection that is its own transpose.
template <class K, class T>
void leave_sliding(T* e) {
  if constexpr (requires { K::yields_in_shape; }) {
    const T mean = T(1.0 / 3.0) * (e[0] + e[1] + e[2]);
    for (int j = 0; j < 3; ++j) e[j] = e[j] - mean;
  }
  if constexpr (requires { K::first_sliding; })
    for (int j = 0; j < K::first_sliding; ++j) e[j] = T(0.0);
}

template <class K, class T>
struct SlidingSpring {
  static constexpr int set = K::dofs - 3 * set_nodes<K>;
  T x[K::dofs], C[K::rows], J[K::rows * K::dofs], e[K::rows];
  decltype(T() > T()) slides;  // per lane
  T f, y_over_length, inverse_length;

  SlidingSpring(const Scene& scene, const Group& group, int item, const T* p, const T* state)
      : SlidingSpring([&](int d) -> const T& { return state[scene.first_dof[group.nodes(item)[d / 3]] + d % 3]; }, p) {}

  // at(d): coordinate d of the stencil.
  template <class At>
  SlidingSpring(At&& at, const T* p) {
    for (int d = 0; d < K::dofs; ++d) x[d] = at(d);
    Slider<K>::evaluate(x, p, C, J);
    const T one(1.0), y = p[K::yield_parameter];
    for (int j = 0; j < K::rows; ++j) {
      e[j] = C[j];
      if constexpr (shares_load<K>) e[j] = C[j] - (one - K::share(p)) * x[set + j];
    }
    leave_sliding<K>(e);
    T length2(0.0);
    for (int j = 0; j < K::rows; ++j) length2 += e[j] * e[j];
    slides = length2 > y * y;
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
void let_slide(const Scene& scene, const Inputs<const T>& in, T* state) {
  if (!scene.yields) return;
  for_each_yielding(scene, [&]<class K>(K, const Group& group, int item, std::size_t value) {
    const SlidingSpring<K, T> at(scene, group, item, in.of(Quantity::rest) + value, state);
    const auto set = group.nodes(item).last(set_nodes<K>);
    for (int j = 0; j < K::rows; ++j) state[scene.first_dof[set[j / 3]] + j % 3] += at.f * at.e[j];
  });
}

// Parameters that C of the sliding spring depends on otherwise than by subtracting them.
template <class K>
inline constexpr int inside_slider = parameter_count<K> - Slider<K>::offsets;

// The derivatives (rows, inside_slider) of C of the sliding spring by these, at its coordinates. Compiled once per kind, in yield.cpp.
void slider_by_parameters(int kind, const double* x, const double* p, double* by_p);

// Along N directions, where it slides: those of coordinates go through the gradient, those of parameters inside C through duals.
template <int N>
void let_slide(const Scene& scene, const Inputs<const Dual<double, N>>& in, Dual<double, N>* state) {
  using Directed = Dual<double, N>;
  if (!scene.yields) return;
  for_each_yielding(scene, [&]<class K>(K, const Group& group, int item, std::size_t value) {
    constexpr int P = parameter_count<K>, inside = inside_slider<K>, set = K::dofs - 3 * set_nodes<K>;
    const Directed* p = in.of(Quantity::rest) + value;
    const auto nodes = group.nodes(item);
    const auto at = [&](int d) -> Directed& { return state[scene.first_dof[nodes[d / 3]] + d % 3]; };
    double own[P];
    for (int k = 0; k < P; ++k) own[k] = p[k].v;
    const SlidingSpring<K, double> values([&](int d) { return at(d).v; }, own);
    if (!values.slides) return;

    // The yield decides when C slides and is no part of it. Most directions change none of the parameters that are.
    bool varies = false;
    for (int k = 0; k < inside; ++k)
      for (int i = 0; i < N; ++i) varies |= k != K::yield_parameter && p[k].d[i] != 0.0;
    double by_p[K::rows * inside]{};
    if (varies) slider_by_parameters(group.kind, values.x, own, by_p);
    Directed e[K::rows];
    for (int j = 0; j < K::rows; ++j) {
      e[j].v = values.C[j];
      for (int i = 0; i < N; ++i) {
        double sum = 0.0;
        if constexpr (Slider<K>::offsets > 0) sum = -p[inside + j].d[i];
        for (int k = 0; k < inside; ++k) sum += by_p[j * inside + k] * p[k].d[i];
        for (int d = 0; d < K::dofs; ++d) sum += values.J[j * K::dofs + d] * at(d).d[i];
        e[j].d[i] = sum;
      }
      if constexpr (shares_load<K>) e[j] -= (Directed(1.0) - K::share(p)) * at(set + j);
    }
    leave_sliding<K>(e);
    Directed length2;
    for (int j = 0; j < K::rows; ++j) length2 += e[j] * e[j];
    // in the order of SlidingSpring, so that the values have its bits
    const Directed f = Directed(1.0) - p[K::yield_parameter] * (Directed(1.0) / sqrt(length2));
    for (int j = 0; j < K::rows; ++j) at(set + j) += f * e[j];
  });
}

struct Yield {
  static constexpr bool repeated = false;
  template <class T>
  using Record = Nothing;

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Nothing&) {
    let_slide(step.scene, step.in, work.x_next);
  }
};

}  // namespace sheetbend
