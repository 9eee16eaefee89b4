#include "adjoint/packs/packed_reverse.h"

#include <algorithm>

#include "adjoint/element/rates_vjp.h"

namespace sheetbend {

template <class T>
void PackCotangents<T>::resize(const PackPlan& plan) {
  eta = 0.0;
  rows.assign(plan.rows());
  colors.resize(plan.colors.size());
  for (std::size_t c = 0; c < colors.size(); ++c) colors[c].resize(plan.colors[c], 2 + plan.colors[c].parameters);
}

template <class T>
std::size_t PackCotangents<T>::bytes(const PackPlan& plan) {
  std::size_t sum = Rows<T>::bytes(plan.rows());
  for (const PackedColor& color : plan.colors)
    sum += sizeof(Pack) * color.packs<T>() * (2 + color.parameters + color.rows * (color.damped ? 2 : 1)) +
           sizeof(ColorNumbers<T>);
  return sum;
}

template <class T>
void begin_sweeps_vjp(const Scene& scene, const PackPlan& plan, int threads, const Inputs<const T>& in,
                      const PackState<T>& state, const Inputs<T>& in_bar, PackCotangents<T>& bar) {
  if (bar.eta != state.eta) finish(scene, plan, in, in_bar, bar);
  bar.eta = state.eta;
  parallel_for(plan.nodes, threads, points_per_thread, [&](int begin, int end) {
    for (int n = begin; n < end; ++n) bar.rows.at(n)[3] = T(0.0);
  });
  std::fill(bar.rows.at(plan.nodes), bar.rows.at(plan.rows()), T(0.0));
  for (auto& color : bar.colors) color.C_r.clear();
}

template <class T>
void sweep_vjp(const PackPlan& plan, const sheetbend_packs::KernelTable& kernels, int threads, int grain, int iteration,
               bool last, PackState<T>& state, PackCotangents<T>& bar) {
  sweep_again(plan, kernels, threads, grain, iteration, state);
  const int recorded = iteration - state.sections.begin(state.recorded);
  for (int c = static_cast<int>(plan.colors.size()) - 1; c >= 0; --c) {
    const PackedColor& color = plan.colors[c];
    typename PackState<T>::ColorState& primal = state.colors[c];
    ColorNumbers<T>& own = bar.colors[c];
    const sheetbend_packs::Reverse reverse{color.count,
                                           last,
                                           color.nodes.data(),
                                           primal.values.numbers(),
                                           color.damped ? primal.C_r.numbers() : nullptr,
                                           primal.records[recorded].numbers(),
                                           bar.rows.numbers(),
                                           own.values.numbers(),
                                           own.lambda.numbers(),
                                           color.damped ? own.C_r.numbers() : nullptr};
    run_kernel(kernels.kinds[color.kind]->project_vjp[layout_of<T>], reverse, color.packs<T>(), threads, grain);
  }
}

template <class T>
void end_sweeps_vjp(const Scene& scene, const PackPlan& plan, int threads, PackCotangents<T>& bar, T* w_bar,
                    T* C_r_bar) {
  parallel_for(plan.nodes, threads, points_per_thread, [&](int begin, int end) {
    for (int n = begin; n < end; ++n) w_bar[n] += bar.rows.at(n)[3];
  });
  for (std::size_t g = 0; g < plan.ghosts.size(); ++g)
    Vec3<T>(bar.rows.at(plan.nodes + static_cast<int>(g))).add_to(bar.rows.at(plan.ghosts[g]));
  for (std::size_t c = 0; c < plan.colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    if (!color.damped) continue;
    for (int i = 0; i < color.count; ++i)
      for (int j = 0; j < color.rows; ++j)
        C_r_bar[scene.groups[color.group].first_row + color.items[i] * color.rows + j] +=
            entry(bar.colors[c].C_r, i, color.rows, j);
  }
}

template <class T>
void finish(const Scene& scene, const PackPlan& plan, const Inputs<const T>& in, const Inputs<T>& in_bar,
            PackCotangents<T>& bar) {
  if (bar.eta == 0.0) return;
  for (std::size_t c = 0; c < plan.colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    const Group& group = scene.groups[color.group];
    const int parts = 2 + color.parameters;
    for (int i = 0; i < color.count; ++i) {
      const auto value_bar = [&](int part) { return entry(bar.colors[c].values, i, parts, part); };
      add_values(in, group, color.items[i], bar.eta, value_bar, in_bar);
    }
    bar.colors[c].values.clear();
  }
  bar.eta = 0.0;
}

#define SHEETBEND_INSTANTIATE(T)                                                                                       \
  template struct PackCotangents<T>;                                                                                   \
  template void begin_sweeps_vjp<T>(const Scene&, const PackPlan&, int, const Inputs<const T>&, const PackState<T>&,   \
                                    const Inputs<T>&, PackCotangents<T>&);                                             \
  template void sweep_vjp<T>(const PackPlan&, const sheetbend_packs::KernelTable&, int, int, int, bool, PackState<T>&, \
                             PackCotangents<T>&);                                                                      \
  template void end_sweeps_vjp<T>(const Scene&, const PackPlan&, int, PackCotangents<T>&, T*, T*);                     \
  template void finish<T>(const Scene&, const PackPlan&, const Inputs<const T>&, const Inputs<T>&, PackCotangents<T>&);
SHEETBEND_INSTANTIATE(double)
SHEETBEND_INSTANTIATE(Pack)

}  // namespace sheetbend
