#include "core/packs/packed_colors.h"

#include <algorithm>

#include "core/element/element.h"

namespace sheetbend {
namespace {

constexpr int lanes = sheetbend_packs::lanes;

// Calls f(lane index in the color, item) for every lane, the repeated ones included.
template <class F>
void for_each_lane(const PackedColor& color, F&& f) {
  for (int i = 0; i < static_cast<int>(color.items.size()); ++i) f(i, color.items[i]);
}

void fill_values(const Scene& scene, const PackedColor& color, const Inputs<const double>& in, double eta,
                 double* values) {
  const Group& group = scene.groups[color.group];
  const int parts = color.value_count();
  for_each_lane(color, [&](int lane, int item) {
    const Rates<double> rates(in.of(Quantity::compliance)[group.first + item],
                              color.damped ? in.of(Quantity::damping)[group.first + item] : 0.0, eta);
    values[lane_at(lane, parts, 0)] = rates.a;
    if (color.damped) {
      values[lane_at(lane, parts, 1)] = rates.g;
      values[lane_at(lane, parts, 2)] = rates.scale;
    }
    for (int k = 0; k < color.parameters; ++k)
      values[lane_at(lane, parts, parts - color.parameters + k)] =
          in.of(Quantity::rest)[group.first_value + static_cast<std::size_t>(item) * color.parameters + k];
  });
}

}  // namespace

PackPlan pack_colors(const Scene& scene, const std::vector<Color>& colors) {
  PackPlan plan;
  plan.nodes = scene.nodes();
  for (const Color& color : colors) {
    const Group& group = scene.groups[color.group];
    const int count = static_cast<int>(color.items.size());
    PackedColor p{
        group.kind,   color.group, count, (count + lanes - 1) / lanes, group.rows, group.arity, group.parameters,
        group.damped, color.items, {}};
    p.items.resize(static_cast<std::size_t>(p.packs) * lanes, color.items.back());
    p.nodes.resize(p.items.size() * group.arity);
    for_each_lane(p, [&](int lane, int item) {
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

void PackState::resize(const PackPlan& plan, int kept_iterations) {
  eta = 0.0;
  rows.assign(plan.rows());
  colors.resize(plan.colors.size());
  for (std::size_t c = 0; c < colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    const std::size_t packs = color.packs;
    colors[c].values.assign(packs * color.value_count(), Pack(0.0));
    colors[c].lambda.assign(packs * color.rows, Pack(0.0));
    colors[c].C_r.assign(color.damped ? packs * color.rows : 0, Pack(0.0));
    colors[c].records.assign(kept_iterations, std::vector<Pack>(packs * color.record_size(), Pack(0.0)));
  }
}

void begin_sweeps(const Scene& scene, const PackPlan& plan, const Inputs<const double>& in, double eta, const double* q,
                  const double* w, const double* C_r, PackState& state) {
  for (std::size_t c = 0; c < plan.colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    PackState::ColorState& own = state.colors[c];
    if (state.eta != eta) fill_values(scene, color, in, eta, numbers(own.values));
    std::fill(own.lambda.begin(), own.lambda.end(), Pack(0.0));
    if (color.damped)
      for_each_lane(color, [&](int lane, int item) {
        for (int j = 0; j < color.rows; ++j)
          numbers(own.C_r)[lane_at(lane, color.rows, j)] =
              C_r[scene.groups[color.group].first_row + item * color.rows + j];
      });
  }
  state.eta = eta;
  const auto fill = [&](int row, int node) {
    double* to = state.rows.at(row);
    Vec3<double>(q + scene.first_dof[node]).store(to);
    to[3] = w[node];
  };
  for (int n = 0; n < plan.nodes; ++n) fill(n, n);
  for (std::size_t g = 0; g < plan.ghosts.size(); ++g) fill(plan.nodes + static_cast<int>(g), plan.ghosts[g]);
}

void sweep(const PackPlan& plan, const sheetbend_packs::KernelTable& kernels, int threads, int grain, int iteration,
           PackState& state) {
  for (std::size_t c = 0; c < plan.colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    PackState::ColorState& own = state.colors[c];
    const sheetbend_packs::Forward forward{color.nodes.data(),
                                           state.rows.at(0),
                                           numbers(own.values),
                                           numbers(own.lambda),
                                           color.damped ? numbers(own.C_r) : nullptr,
                                           own.records.empty() ? nullptr : numbers(own.records[iteration])};
    run_kernel(kernels.project[color.kind], forward, color.packs, threads, grain);
  }
}

void end_sweeps(const Scene& scene, const PackPlan& plan, PackState& state, double* q) {
  for (int n = 0; n < plan.nodes; ++n) Vec3<double>(state.rows.at(n)).store(q + scene.first_dof[n]);
}

void unpack_multipliers(const Scene& scene, const PackPlan& plan, PackState& state, double* lambda) {
  for (std::size_t c = 0; c < plan.colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    const double* own = numbers(state.colors[c].lambda);
    for (int lane = 0; lane < color.count; ++lane)
      for (int j = 0; j < color.rows; ++j)
        lambda[scene.groups[color.group].first_row + color.items[lane] * color.rows + j] =
            own[lane_at(lane, color.rows, j)];
  }
}

}  // namespace sheetbend
