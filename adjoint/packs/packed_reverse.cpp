#include "adjoint/packs/packed_reverse.h"

#include <algorithm>

#include "adjoint/element/rates_vjp.h"

namespace sheetbend {
namespace {

void clear(std::vector<Pack>& v) { std::fill(v.begin(), v.end(), Pack(0.0)); }

void load_cotangents(const Scene& scene, const PackPlan& plan, const double* x_bar, PackCotangents& bar) {
  bar.rows.clear();
  for (int n = 0; n < plan.nodes; ++n) Vec3<double>(x_bar + scene.first_dof[n]).store(bar.rows.at(n));
  for (auto& color : bar.colors) {
    clear(color.lambda);
    clear(color.C_r);
  }
}

void hand_on(const Scene& scene, const PackPlan& plan, PackCotangents& bar, double* x_bar, double* w_bar,
             double* C_r_bar) {
  for (int n = 0; n < plan.nodes; ++n) {
    Vec3<double>(bar.rows.at(n)).store(x_bar + scene.first_dof[n]);
    w_bar[n] += bar.rows.at(n)[3];
  }
  for (std::size_t g = 0; g < plan.ghosts.size(); ++g)
    for (int d = 0; d < 3; ++d)
      x_bar[scene.first_dof[plan.ghosts[g]] + d] += bar.rows.at(plan.nodes + static_cast<int>(g))[d];
  for (std::size_t c = 0; c < plan.colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    if (!color.damped) continue;
    for (int lane = 0; lane < color.count; ++lane)
      for (int j = 0; j < color.rows; ++j)
        C_r_bar[scene.groups[color.group].first_row + color.items[lane] * color.rows + j] +=
            numbers(bar.colors[c].C_r)[lane_at(lane, color.rows, j)];
  }
}

}  // namespace

void PackCotangents::resize(const PackPlan& plan) {
  eta = 0.0;
  rows.assign(plan.rows());
  colors.resize(plan.colors.size());
  for (std::size_t c = 0; c < colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    const std::size_t packs = color.packs;
    colors[c].values.assign(packs * (2 + color.parameters), Pack(0.0));
    colors[c].lambda.assign(packs * color.rows, Pack(0.0));
    colors[c].C_r.assign(color.damped ? packs * color.rows : 0, Pack(0.0));
  }
}

void reverse_sweeps(const Scene& scene, const PackPlan& plan, const sheetbend_packs::KernelTable& kernels,
                    int iterations, int threads, int grain, const Inputs<const double>& in, PackState& state,
                    double* x_bar, double* w_bar, double* C_r_bar, const Inputs<double>& in_bar, PackCotangents& bar) {
  if (bar.eta != state.eta) finish(scene, plan, in, in_bar, bar);
  bar.eta = state.eta;
  load_cotangents(scene, plan, x_bar, bar);
  for (int iteration = iterations - 1; iteration >= 0; --iteration)
    for (int c = static_cast<int>(plan.colors.size()) - 1; c >= 0; --c) {
      const PackedColor& color = plan.colors[c];
      PackState::ColorState& primal = state.colors[c];
      PackCotangents::ColorCotangents& own = bar.colors[c];
      const sheetbend_packs::Reverse reverse{color.nodes.data(),
                                             state.rows.at(0),
                                             numbers(primal.values),
                                             color.damped ? numbers(primal.C_r) : nullptr,
                                             numbers(primal.records[iteration]),
                                             bar.rows.at(0),
                                             numbers(own.values),
                                             numbers(own.lambda),
                                             color.damped ? numbers(own.C_r) : nullptr};
      run_kernel(kernels.project_vjp[color.kind], reverse, color.packs, threads, grain);
    }
  hand_on(scene, plan, bar, x_bar, w_bar, C_r_bar);
}

void finish(const Scene& scene, const PackPlan& plan, const Inputs<const double>& in, const Inputs<double>& in_bar,
            PackCotangents& bar) {
  if (bar.eta == 0.0) return;
  for (std::size_t c = 0; c < plan.colors.size(); ++c) {
    const PackedColor& color = plan.colors[c];
    const Group& group = scene.groups[color.group];
    const int parts = 2 + color.parameters;
    for (int lane = 0; lane < color.count; ++lane) {
      const double* values = numbers(bar.colors[c].values);
      const int item = color.items[lane];
      add_rates(in, group, item, bar.eta, values[lane_at(lane, parts, 0)], values[lane_at(lane, parts, 1)], in_bar);
      for (int k = 0; k < color.parameters; ++k)
        in_bar.of(Quantity::rest)[group.first_value + static_cast<std::size_t>(item) * color.parameters + k] +=
            values[lane_at(lane, parts, 2 + k)];
    }
    clear(bar.colors[c].values);
  }
  bar.eta = 0.0;
}

}  // namespace sheetbend
