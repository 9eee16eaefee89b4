#include "core/packs/packed_colors.h"

#include "core/constraints/registry.h"
#include "core/element/element.h"

namespace sheetbend {
namespace {

constexpr int lanes = sheetbend_packs::lanes;

template <class T, class F>
void for_each_entry(const PackedColor& color, F&& f) {
  for (int i = 0; i < color.entries<T>(); ++i) f(i, color.items[i]);
}

template <class T>
void fill_values(const Scene& scene, const PackedColor& color, const Inputs<const T>& in, double eta,
                 Numbers<T>& values) {
  const Group& group = scene.groups[color.group];
  const int parts = color.value_count();
  for_each_entry<T>(color, [&](int i, int item) {
    int part = 0;
    const auto put = [&](const T& value) { entry(values, i, parts, part++) = value; };
    const Rates<T> rates(in.of(Quantity::compliance)[group.first + item],
                         color.damped ? in.of(Quantity::damping)[group.first + item] : T(0.0), eta);
    put(rates.a);
    if (color.damped) {
      put(rates.g);
      put(rates.scale);
    }
    for (int k = 0; k < color.parameters; ++k)
      put(in.of(Quantity::rest)[group.first_value + static_cast<std::size_t>(item) * color.parameters + k]);
  });
}

// The inverse masses, and the inverses of the matrices that depend on nothing else.
template <class T>
void fill_weights(const Scene& scene, const PackedColor& color, const T* w, Numbers<T>& values) {
  const Group& group = scene.groups[color.group];
  const int parts = color.value_count(), first = parts - color.arity;
  for_each_entry<T>(color, [&](int i, int item) {
    T sum(0.0);
    for (int k = 0; k < color.arity; ++k) {
      const T& own = w[group.nodes(item)[k]];
      entry(values, i, parts, first + k) = own;
      sum = k == 0 ? own : sum + own;
    }
    if (!color.unit_gradients) return;
    Rates<T> rates;
    rates.a = entry(values, i, parts, 0);
    if (color.damped) rates.scale = entry(values, i, parts, 2);
    entry(values, i, parts, first - 1) = inverse_of_unit_matrix(sum, rates);
  });
}

}  // namespace

PackPlan pack_colors(const Scene& scene, const std::vector<Color>& colors) {
  PackPlan plan;
  plan.nodes = scene.nodes();
  for (const Color& color : colors) {
    const Group& group = scene.groups[color.group];
    const int count = static_cast<int>(color.items.size());
    PackedColor p;
    p.kind = group.kind, p.group = color.group, p.count = count, p.damped = group.damped, p.items = color.items;
    with_kind(group.kind, [&]<class K>(K) {
      p.rows = K::rows, p.arity = K::arity, p.parameters = parameter_count<K>;
      p.kept = Kept<K, double>::size, p.unit_gradients = K::unit_gradients;
    });
    p.items.resize((p.items.size() + lanes - 1) / lanes * lanes, color.items.back());
    p.nodes.resize(p.items.size() * group.arity);
    for_each_entry<double>(p, [&](int lane, int item) {
      for (int k = 0; k < group.arity; ++k) {
        int& to = p.nodes[lane_at(lane, group.arity, k)];
        const int node = group.nodes(item)[k];
        if (scene.role[node] == Role::free) {
          to = sheetbend_packs::row * node;
        } else if (lane >= count) {
          to = p.nodes[lane_at(count - 1, group.arity, k)];  // a repeated constraint shares its ghosts
        } else {
          to = sheetbend_packs::row * plan.rows();
          plan.ghosts.push_back(node);
        }
      }
    });
    plan.colors.push_back(std::move(p));
  }
  return plan;
}

template <class T>
void PackState<T>::resize(const PackPlan& plan, int kept_iterations) {
  eta = 0.0;
  rows.assign(plan.rows());
  colors.resize(plan.colors.size());
  for (std::size_t c = 0; c < colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    colors[c].resize(color, color.value_count());
    colors[c].records.resize(kept_iterations);
    for (auto& record : colors[c].records)
      record.assign(static_cast<std::size_t>(color.packs<T>()) * color.record_size());
  }
}

template <class T>
void begin_sweeps(const Scene& scene, const PackPlan& plan, const Inputs<const T>& in, double eta, const T* w,
                  const T* C_r, PackState<T>& state, [[maybe_unused]] const T* q) {
  const bool fresh = state.eta != eta;
  for (std::size_t c = 0; c < plan.colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    typename PackState<T>::ColorState& own = state.colors[c];
    if (fresh) fill_values(scene, color, in, eta, own.values);
    if (fresh || scene.has_drag) fill_weights(scene, color, w, own.values);
    if (color.damped)
      for_each_entry<T>(color, [&](int i, int item) {
        for (int j = 0; j < color.rows; ++j)
          entry(own.C_r, i, color.rows, j) = C_r[scene.groups[color.group].first_row + item * color.rows + j];
      });
  }
  state.eta = eta;
  constexpr long row = sheetbend_packs::row;
  if constexpr (carries_tangents<T>)
    for (int n = 0; n < plan.nodes; ++n)
      for (int d = 0; d < 3; ++d) state.rows[row * n + d] = q[scene.first_dof[n] + d];
  for (std::size_t g = 0; g < plan.ghosts.size(); ++g)
    for (int d = 0; d < 3; ++d)
      state.rows[row * (plan.nodes + static_cast<long>(g)) + d] = T(state.rows[row * plan.ghosts[g] + d]);
}

template <class T>
void end_sweeps([[maybe_unused]] const Scene& scene, [[maybe_unused]] PackState<T>& state, [[maybe_unused]] T* q) {
  if constexpr (carries_tangents<T>)
    for (int n = 0; n < scene.nodes(); ++n)
      for (int d = 0; d < 3; ++d)
        q[scene.first_dof[n] + d] = state.rows[sheetbend_packs::row * static_cast<long>(n) + d];
}

template <class T>
void sweep(const PackPlan& plan, const sheetbend_packs::KernelTable& kernels, int threads, int grain, int iteration,
           PackState<T>& state) {
  for (std::size_t c = 0; c < plan.colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    typename PackState<T>::ColorState& own = state.colors[c];
    const sheetbend_packs::Forward forward{color.count,
                                           iteration == 0,
                                           color.nodes.data(),
                                           state.rows.numbers(),
                                           own.values.numbers(),
                                           own.lambda.numbers(),
                                           color.damped ? own.C_r.numbers() : nullptr,
                                           own.records.empty() ? nullptr : own.records[iteration].numbers()};
    if constexpr (carries_tangents<T>) {
      const sheetbend_packs::Tangents tangents{forward,
                                               T::directions,
                                               state.rows.directions(),
                                               own.values.directions(),
                                               own.lambda.directions(),
                                               color.damped ? own.C_r.directions() : nullptr};
      run_kernel(kernels.project_tangents[color.kind], tangents, color.packs<T>(), threads, grain);
    }
    run_kernel(kernels.project[layout_of<T>][color.kind], forward, color.packs<T>(), threads, grain);
  }
}

template <class T>
void unpack_multipliers(const Scene& scene, const PackPlan& plan, PackState<T>& state, T* lambda) {
  for (std::size_t c = 0; c < plan.colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    for (int i = 0; i < color.count; ++i)
      for (int j = 0; j < color.rows; ++j)
        lambda[scene.groups[color.group].first_row + color.items[i] * color.rows + j] =
            entry(state.colors[c].lambda, i, color.rows, j);
  }
}

#define SHEETBEND_INSTANTIATE(T)                                                                                   \
  template struct PackState<T>;                                                                                    \
  template void begin_sweeps<T>(const Scene&, const PackPlan&, const Inputs<const T>&, double, const T*, const T*, \
                                PackState<T>&, const T*);                                                          \
  template void end_sweeps<T>(const Scene&, PackState<T>&, T*);                                                    \
  template void sweep<T>(const PackPlan&, const sheetbend_packs::KernelTable&, int, int, int, PackState<T>&);      \
  template void unpack_multipliers<T>(const Scene&, const PackPlan&, PackState<T>&, T*);
SHEETBEND_INSTANTIATE(double)
SHEETBEND_INSTANTIATE(Pack)
using Dual4 = Dual<double, 4>;
using Dual8 = Dual<double, 8>;
SHEETBEND_INSTANTIATE(Dual4)
SHEETBEND_INSTANTIATE(Dual8)

}  // namespace sheetbend
