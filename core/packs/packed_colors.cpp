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

// Calls f(now, then, count) for the rows and for each color's multipliers, now and where a section begins.
template <class T, class F>
void with_beginning(const PackPlan& plan, PackState<T>& state, int section, F&& f) {
  if constexpr (!carries_tangents<T>) {  // those are never reversed
    f(state.rows.data(), state.rows_before[section - 1].data(), sheetbend_packs::row * plan.rows());
    for (std::size_t c = 0; c < plan.colors.size(); ++c) {
      auto& color = state.colors[c];
      f(color.lambda.data(), color.lambda_before[section - 1].data(), plan.colors[c].multipliers<T>());
    }
  }
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
Sections sections_of(const PackPlan& plan, int sweeps, std::size_t whole, std::size_t section) {
  std::size_t bytes = 0;  // of a sweep's record
  for (const PackedColor& color : plan.colors) bytes += sizeof(Pack) * color.record_packs<T>();
  if (sweeps * bytes <= whole) return {sweeps, sweeps};
  return {sweeps, std::clamp(static_cast<int>(section / bytes), 1, sweeps)};
}

template <class T>
void PackState<T>::resize(const PackPlan& plan, const Sections& of) {
  eta = 0.0;
  sections = of;
  rows.assign(plan.rows());
  rows_before.resize(std::max(1, sections.count()) - 1);
  for (auto& before : rows_before) before.assign(plan.rows());
  colors.resize(plan.colors.size());
  for (std::size_t c = 0; c < colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    colors[c].resize(color, color.value_count());
    colors[c].records.resize(sections.length);
    for (auto& record : colors[c].records) record.assign(color.record_packs<T>());
    colors[c].lambda_before.resize(rows_before.size());
    for (auto& before : colors[c].lambda_before) before.assign(color.multipliers<T>());
  }
}

template <class T>
std::size_t PackState<T>::bytes(const PackPlan& plan, const Sections& sections) {
  const std::size_t begun = std::max(1, sections.count());  // the sweeps as they go, and where sections begin
  std::size_t sum = begun * Rows<T>::bytes(plan.rows()) + (begun - 1) * sizeof(Rows<T>);
  for (const PackedColor& color : plan.colors) {
    const std::size_t each = color.value_count() + color.rows * (begun + (color.damped ? 1 : 0));
    sum += sizeof(Pack) * (color.packs<T>() * each + sections.length * color.record_packs<T>()) + sizeof(ColorState) +
           sections.length * sizeof(Numbers<Pack>) + (begun - 1) * sizeof(Numbers<T>);
  }
  return sum;
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
  state.recorded = 0;
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
  const Sections& sections = state.sections;
  const int section = sections.of(iteration);
  const bool keeps = sections.length > 0 && section == state.recorded;
  if (section > state.recorded && iteration == sections.begin(section))
    with_beginning(plan, state, section, [](const T* now, T* then, int count) { std::copy_n(now, count, then); });
  for (std::size_t c = 0; c < plan.colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    typename PackState<T>::ColorState& own = state.colors[c];
    const sheetbend_packs::Forward forward{
        color.count,
        iteration == 0,
        color.nodes.data(),
        state.rows.numbers(),
        own.values.numbers(),
        own.lambda.numbers(),
        color.damped ? own.C_r.numbers() : nullptr,
        keeps ? own.records[iteration - sections.begin(section)].numbers() : nullptr};
    if constexpr (carries_tangents<T>) {
      const sheetbend_packs::Tangents tangents{forward,
                                               T::directions,
                                               state.rows.directions(),
                                               own.values.directions(),
                                               own.lambda.directions(),
                                               color.damped ? own.C_r.directions() : nullptr};
      run_kernel(kernels.kinds[color.kind]->project_tangents, tangents, color.packs<T>(), threads, grain);
    }
    run_kernel(kernels.kinds[color.kind]->project[layout_of<T>], forward, color.packs<T>(), threads, grain);
  }
}

template <class T>
void sweep_again(const PackPlan& plan, const sheetbend_packs::KernelTable& kernels, int threads, int grain,
                 int iteration, PackState<T>& state) {
  const int section = state.sections.of(iteration);
  if (section == state.recorded) return;
  state.recorded = section;
  with_beginning(plan, state, section, [](T* now, const T* then, int count) { std::copy_n(then, count, now); });
  for (int i = state.sections.begin(section); i <= iteration; ++i) sweep(plan, kernels, threads, grain, i, state);
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
  template Sections sections_of<T>(const PackPlan&, int, std::size_t, std::size_t);                                \
  template struct PackState<T>;                                                                                    \
  template void begin_sweeps<T>(const Scene&, const PackPlan&, const Inputs<const T>&, double, const T*, const T*, \
                                PackState<T>&, const T*);                                                          \
  template void end_sweeps<T>(const Scene&, PackState<T>&, T*);                                                    \
  template void sweep<T>(const PackPlan&, const sheetbend_packs::KernelTable&, int, int, int, PackState<T>&);      \
  template void unpack_multipliers<T>(const Scene&, const PackPlan&, PackState<T>&, T*);
SHEETBEND_INSTANTIATE(double)
SHEETBEND_INSTANTIATE(Pack)
template void sweep_again<double>(const PackPlan&, const sheetbend_packs::KernelTable&, int, int, int,
                                  PackState<double>&);
template void sweep_again<Pack>(const PackPlan&, const sheetbend_packs::KernelTable&, int, int, int, PackState<Pack>&);
using Dual4 = Dual<double, 4>;
using Dual8 = Dual<double, 8>;
SHEETBEND_INSTANTIATE(Dual4)
SHEETBEND_INSTANTIATE(Dual8)

}  // namespace sheetbend
