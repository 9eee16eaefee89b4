#include "adjoint/packs/packed_reverse.h"

#include <algorithm>

#include "adjoint/element/rates_vjp.h"

namespace sheetbend {
namespace {

void clear(std::vector<Pack>& v) { std::fill(v.begin(), v.end(), Pack(0.0)); }

template <class T>
void begin(const PackPlan& plan, int threads, PackCotangents<T>& bar) {
  parallel_for(plan.nodes, threads, points_per_thread, [&](int begin, int end) {
    for (int n = begin; n < end; ++n) bar.rows.at(n)[3] = T(0.0);
  });
  std::fill(bar.rows.at(plan.nodes), bar.rows.at(plan.rows()), T(0.0));
  for (auto& color : bar.colors) clear(color.C_r);
}

template <class T>
void end(const Scene& scene, const PackPlan& plan, PackCotangents<T>& bar, T* C_r_bar) {
  for (std::size_t g = 0; g < plan.ghosts.size(); ++g)
    Vec3<T>(bar.rows.at(plan.nodes + static_cast<int>(g))).add_to(bar.rows.at(plan.ghosts[g]));
  for (std::size_t c = 0; c < plan.colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    if (!color.damped) continue;
    for (int i = 0; i < color.count; ++i)
      for (int j = 0; j < color.rows; ++j)
        C_r_bar[scene.groups[color.group].first_row + color.items[i] * color.rows + j] +=
            entry<T>(bar.colors[c].C_r, i, color.rows, j);
  }
}

}  // namespace

template <class T>
void PackCotangents<T>::resize(const PackPlan& plan) {
  eta = 0.0;
  rows.assign(plan.rows());
  colors.resize(plan.colors.size());
  for (std::size_t c = 0; c < colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    const std::size_t packs = color.packs<T>();
    colors[c].values.assign(packs * (2 + color.parameters), Pack(0.0));
    colors[c].lambda.assign(packs * color.rows, Pack(0.0));
    colors[c].C_r.assign(color.damped ? packs * color.rows : 0, Pack(0.0));
  }
}

template <class T>
void reverse_sweeps(const Scene& scene, const PackPlan& plan, const sheetbend_packs::KernelTable& kernels,
                    int iterations, int threads, int grain, const Inputs<const T>& in, PackState<T>& state, T* C_r_bar,
                    const Inputs<T>& in_bar, PackCotangents<T>& bar) {
  if (bar.eta != state.eta) finish(scene, plan, in, in_bar, bar);
  bar.eta = state.eta;
  begin(plan, threads, bar);
  for (int iteration = iterations - 1; iteration >= 0; --iteration)
    for (int c = static_cast<int>(plan.colors.size()) - 1; c >= 0; --c) {
      const PackedColor& color = plan.colors[c];
      typename PackState<T>::ColorState& primal = state.colors[c];
      typename PackCotangents<T>::ColorCotangents& own = bar.colors[c];
      const sheetbend_packs::Reverse reverse{color.count,
                                             iteration == iterations - 1,
                                             color.nodes.data(),
                                             numbers(primal.values),
                                             color.damped ? numbers(primal.C_r) : nullptr,
                                             numbers(primal.records[iteration]),
                                             bar.rows.data(),
                                             numbers(own.values),
                                             numbers(own.lambda),
                                             color.damped ? numbers(own.C_r) : nullptr};
      run_kernel(kernels.project_vjp[layout_of<T>][color.kind], reverse, color.packs<T>(), threads, grain);
    }
  end(scene, plan, bar, C_r_bar);
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
      const auto value_bar = [&](int part) { return entry<T>(bar.colors[c].values, i, parts, part); };
      add_values(in, group, color.items[i], bar.eta, value_bar, in_bar);
    }
    clear(bar.colors[c].values);
  }
  bar.eta = 0.0;
}

#define SHEETBEND_INSTANTIATE(T)                                                                                     \
  template struct PackCotangents<T>;                                                                                 \
  template void reverse_sweeps<T>(const Scene&, const PackPlan&, const sheetbend_packs::KernelTable&, int, int, int, \
                                  const Inputs<const T>&, PackState<T>&, T*, const Inputs<T>&, PackCotangents<T>&);  \
  template void finish<T>(const Scene&, const PackPlan&, const Inputs<const T>&, const Inputs<T>&, PackCotangents<T>&);
SHEETBEND_INSTANTIATE(double)
SHEETBEND_INSTANTIATE(Pack)

}  // namespace sheetbend
