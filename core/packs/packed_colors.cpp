#include "core/packs/packed_colors.h"

#include "core/constraints/registry.h"
#include "core/element/element.h"

namespace sheetbend {
namespace {

constexpr int lanes = sheetbend_packs::lanes;

// Calls f(i, item) for every constraint of the color, those that only fill up a pack included.
template <class T, class F>
void for_each_entry(const PackedColor& color, F&& f) {
  const int count = std::is_same_v<T, Pack> ? color.count : static_cast<int>(color.items.size());
  for (int i = 0; i < count; ++i) f(i, color.items[i]);
}

template <class T>
void fill_values(const Scene& scene, const PackedColor& color, const Inputs<const T>& in, double eta,
                 std::vector<Pack>& values) {
  const Group& group = scene.groups[color.group];
  const int parts = color.value_count();
  for_each_entry<T>(color, [&](int i, int item) {
    int part = 0;
    const auto put = [&](const T& value) { entry<T>(values, i, parts, part++) = value; };
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
void fill_weights(const Scene& scene, const PackedColor& color, const T* w, std::vector<Pack>& values) {
  const Group& group = scene.groups[color.group];
  const int parts = color.value_count(), first = parts - color.arity;
  for_each_entry<T>(color, [&](int i, int item) {
    T sum(0.0);
    for (int k = 0; k < color.arity; ++k) {
      const T& own = entry<T>(values, i, parts, first + k) = w[group.nodes(item)[k]];
      sum = k == 0 ? own : sum + own;
    }
    if (!color.unit_gradients) return;
    Rates<T> rates;
    rates.a = entry<T>(values, i, parts, 0);
    if (color.damped) rates.scale = entry<T>(values, i, parts, 2);
    entry<T>(values, i, parts, first - 1) = inverse_of_unit_matrix(sum, rates);
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
    const std::size_t packs = color.packs<T>();
    colors[c].values.assign(packs * color.value_count(), Pack(0.0));
    colors[c].lambda.assign(packs * color.rows, Pack(0.0));
    colors[c].C_r.assign(color.damped ? packs * color.rows : 0, Pack(0.0));
    colors[c].records.resize(kept_iterations);
    for (auto& record : colors[c].records) record.assign(packs * color.record_size(), Pack(0.0));
  }
}

template <class T>
void begin_sweeps(const Scene& scene, const PackPlan& plan, const Inputs<const T>& in, double eta, const T* w,
                  const T* C_r, PackState<T>& state) {
  const bool fresh = state.eta != eta;
  for (std::size_t c = 0; c < plan.colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    typename PackState<T>::ColorState& own = state.colors[c];
    if (fresh) fill_values(scene, color, in, eta, own.values);
    if (fresh || scene.has_drag) fill_weights(scene, color, w, own.values);
    if (color.damped)
      for_each_entry<T>(color, [&](int i, int item) {
        for (int j = 0; j < color.rows; ++j)
          entry<T>(own.C_r, i, color.rows, j) = C_r[scene.groups[color.group].first_row + item * color.rows + j];
      });
  }
  state.eta = eta;
  for (std::size_t g = 0; g < plan.ghosts.size(); ++g)
    Vec3<T>(state.rows.at(plan.ghosts[g])).store(state.rows.at(plan.nodes + static_cast<int>(g)));
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
                                           state.rows.data(),
                                           numbers(own.values),
                                           numbers(own.lambda),
                                           color.damped ? numbers(own.C_r) : nullptr,
                                           own.records.empty() ? nullptr : numbers(own.records[iteration])};
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
            entry<T>(state.colors[c].lambda, i, color.rows, j);
  }
}

#define SHEETBEND_INSTANTIATE(T)                                                                                   \
  template struct PackState<T>;                                                                                    \
  template void begin_sweeps<T>(const Scene&, const PackPlan&, const Inputs<const T>&, double, const T*, const T*, \
                                PackState<T>&);                                                                    \
  template void sweep<T>(const PackPlan&, const sheetbend_packs::KernelTable&, int, int, int, PackState<T>&);      \
  template void unpack_multipliers<T>(const Scene&, const PackPlan&, PackState<T>&, T*);
SHEETBEND_INSTANTIATE(double)
SHEETBEND_INSTANTIATE(Pack)

}  // namespace sheetbend
