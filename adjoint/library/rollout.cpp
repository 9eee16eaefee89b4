#include <sheetbend/rollout.h>

#include <cmath>
#include <optional>

#include "adjoint/library/model.h"
#include "adjoint/rollout/rollout.h"
#include "core/rollout/redundant_rows.h"

namespace sheetbend::v0 {
namespace {

// Substep numbers of times.
std::vector<int> substeps(std::span<const double> times, double h) {
  if (times.empty()) throw InputError("times", "are empty", "give at least one");
  std::vector<int> steps;
  double before = 0.0;
  for (const double t : times) {
    if (!(t >= before) || !std::isfinite(t))
      throw InputError("times", "must be ascending from 0 or later", "sort them");
    before = t;
    const double step = std::nearbyint(t / h);
    if (std::abs(t / h - step) > 1e-6 * std::max(step, 1.0))
      throw InputError("times", std::to_string(t) + " s does not lie on the grid of substeps",
                       "choose h so that it divides the interval of frames");
    if (step > std::numeric_limits<int>::max()) throw InputError("times", "take too many substeps", "end earlier");
    steps.push_back(static_cast<int>(step));
  }
  return steps;
}

}  // namespace

struct Rollout::Parts {
  Scene scene;
  Plan plan;
  std::vector<int> steps;
  std::vector<double> theta, inputs, times, positions;
  std::optional<Tape<double>> tape;

  const Model& model() const { return *Model::of(scene); }
};

Rollout::Rollout(const Scene& scene, std::span<const double> times, const Solver& solver,
                 std::span<const double> values)
    : parts_(new Parts{scene, plan_of(*Model::of(scene), solver), {}, {}, {}, {}, {}, {}}) {
  Parts& p = *parts_;
  const Model& model = p.model();
  p.steps = substeps(times, solver.h);
  for (const int step : p.steps) p.times.push_back(step * solver.h);
  p.theta = checked_values(model, values);
  p.inputs = checked_inputs(model, values);
  p.positions.resize(p.steps.size() * static_cast<std::size_t>(model.topology.dofs()));
  translated([&] {
    const TapePlan plan = plan_tape<double>(model.topology, p.plan, p.steps.back(), p.steps.size(), 1, solver.memory);
    p.tape.emplace(record_rollout(model.topology, p.plan, p.inputs.data(), 0.0, p.steps, p.positions.data(),
                                  plan.states, nullptr));
  });
}

Rollout::~Rollout() = default;
Rollout::Rollout(Rollout&&) noexcept = default;
Rollout& Rollout::operator=(Rollout&&) noexcept = default;

std::span<const double> Rollout::times() const { return parts_->times; }
std::span<const double> Rollout::positions() const { return parts_->positions; }

std::span<const double> Rollout::frame(std::size_t i) const {
  if (i >= parts_->times.size())
    throw InputError("frame", std::to_string(i) + " does not exist",
                     "give less than " + std::to_string(parts_->times.size()));
  const auto dofs = static_cast<std::size_t>(parts_->model().topology.dofs());
  return positions().subspan(i * dofs, dofs);
}

Gradient Rollout::gradient(std::span<const double> positions_bar) const {
  Parts& p = *parts_;
  const Model& model = p.model();
  check_size("positions_bar", positions_bar.size(), p.positions.size());
  check_finite("positions_bar", positions_bar);
  Gradient g{p.scene, std::vector<double>(p.theta.size()), std::vector<double>(p.inputs.size())};
  translated([&] {
    g.recomputed = reverse_rollout(model.topology, p.plan, p.inputs.data(), 0.0, *p.tape, p.steps, positions_bar.data(),
                                   g.inputs.data(), nullptr);
  });
  model.map.pull_back(p.theta.data(), g.inputs.data(), g.quantities.data());
  return g;
}

std::vector<double> Rollout::tangent(std::span<const double> values_dot) const {
  using D = Dual<double, 1>;
  const Parts& p = *parts_;
  check_size("values_dot", values_dot.size(), p.theta.size());
  check_finite("values_dot", values_dot);
  std::vector<D> theta(p.theta.begin(), p.theta.end()), inputs(p.inputs.size());
  for (std::size_t k = 0; k < theta.size(); ++k) theta[k].d[0] = values_dot[k];
  p.model().map.apply(theta.data(), inputs.data());
  std::vector<double> positions_dot(p.positions.size());
  translated([&] {
    sheetbend::Rollout<D> run(p.model().topology, p.plan, inputs.data());
    auto to = positions_dot.begin();
    auto next = p.steps.begin();
    const int dofs = p.model().topology.dofs();
    run.run(p.steps.back(), [&](int step, const D* x, const D*) {
      for (; next != p.steps.end() && *next == step; ++next)
        for (int i = 0; i < dofs; ++i) *to++ = x[i].d[0];
    });
  });
  return positions_dot;
}

std::string redundant_constraints(const Scene& scene, const Solver& solver) {
  const Model& model = *Model::of(scene);
  const std::vector<double> inputs = checked_inputs(model, {});
  const Plan plan = plan_of(model, solver);
  return translated([&] {
    const double* x = inputs.data() + model.topology.layout.of(sheetbend::Quantity::position);
    return describe(model.topology, redundant_rows(model.topology, plan, inputs.data(), 0.0), x);
  });
}

}  // namespace sheetbend::v0
