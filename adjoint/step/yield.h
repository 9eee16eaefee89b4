// The reverse of Yield on the state that it found:  with b = set'_bar,
//   e_bar = f b + (y/|e|^3) (e.b) e,   y_bar = -(e.b)/|e|,   set_bar = b - e_bar,   x_bar = J^T e_bar.
#pragma once

#include "adjoint/element/any_kind_vjp.h"
#include "adjoint/element/constraint_vjp.h"
#include "adjoint/step/stages.h"
#include "core/step/retract_directors.h"
#include "core/step/yield.h"

namespace sheetbend {

// The state that Yield found, from the corrected coordinates.
template <class T>
void read_found(const Scene& scene, const Coordinates<T>& corrected, T* state) {
  for (int n = 0; n < scene.nodes(); ++n) Vec3<T>(corrected.of(n)).store(state + scene.first_dof[n]);
  retract_directors(scene, state);
}

// x_bar (dofs) goes in as the cotangent of the state after, and comes out as that of the state before. No two constraints share a set.
template <class T>
void let_slide_vjp(const Scene& scene, const Inputs<const T>& in, const T* state, T* x_bar, const Inputs<T>& in_bar) {
  for_each_yielding(scene, [&]<class K>(K, const Group& group, int item, std::size_t value) {
    const T* p = in.of(Quantity::rest) + value;
    T* p_bar = in_bar.of(Quantity::rest) + value;
    const SlidingSpring<K, T> at(scene, group, item, p, state);
    const auto nodes = group.nodes(item);
    const auto set = nodes.last(set_nodes<K>);
    const auto set_bar = [&](int j) -> T& { return x_bar[scene.first_dof[set[j / 3]] + j % 3]; };
    T along(0.0), e_bar[K::rows];
    for (int j = 0; j < K::rows; ++j) along += at.e[j] * set_bar(j);
    along *= at.inverse_length;
    p_bar[K::yield_parameter] -= along;
    for (int j = 0; j < K::rows; ++j)
      e_bar[j] = at.f * set_bar(j) + at.y_over_length * at.inverse_length * along * at.e[j];
    leave_sliding<K>(e_bar);

    // de/dset = -1; with a share e = C - (1 - share) set, where C holds -share set: by the share 0
    T by_x[K::dofs]{}, by_p[parameter_count<K>]{};
    if constexpr (std::is_same_v<Slider<K>, K>)
      values_vjp(group.kind, at.x, p, e_bar, by_x, by_p);
    else
      values_vjp<Slider<K>>(at.x, p, e_bar, by_x, by_p);
    for (int d = 0; d < at.set; ++d) x_bar[scene.first_dof[nodes[d / 3]] + d % 3] += by_x[d];
    for (int j = 0; j < K::rows; ++j) set_bar(j) -= e_bar[j];
    if constexpr (shares_load<K>) by_p[K::share_parameter] = T(0.0);
    for (int k = 0; k < parameter_count<K>; ++k) p_bar[k] += by_p[k];
  });
}

template <>
struct ReverseOf<Yield> {
  template <class T>
  struct Scratch {
    std::vector<T> found;  // the state before what yields has yielded

    void resize(const Scene& scene, const Plan&) {
      if (scene.yields) found.resize(scene.dofs());
    }
    static std::size_t bytes(const Scene& scene, const Plan&) { return scene.yields ? sizeof(T) * scene.dofs() : 0; }
  };

  template <class T>
  static void run(const Step<T>& step, const Work<T>& work, Nothing&, Scratch<T>& scratch,
                  const StepCotangents<T>& bar) {
    if (!step.scene.yields) return;
    read_found(step.scene, work.q, scratch.found.data());
    let_slide_vjp(step.scene, step.in, scratch.found.data(), bar.x_next, bar.in);
  }
};

}  // namespace sheetbend
