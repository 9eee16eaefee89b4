#include <sheetbend/equilibrium.h>

#include "adjoint/equilibrium/equilibrium_vjp.h"
#include "adjoint/library/model.h"

namespace sheetbend::v0 {

struct Equilibrium::Parts {
  Scene scene;
  std::vector<double> theta, inputs;
  sheetbend::Equilibrium at;

  const Model& model() const { return *Model::of(scene); }
  EquilibriumDerivative derivative() const { return {model().topology, inputs.data(), at}; }
};

Equilibrium::Equilibrium(const Scene& scene, std::span<const double> values, std::span<const double> start)
    : parts_(
          new Parts{scene, checked_values(*Model::of(scene), values), checked_inputs(*Model::of(scene), values), {}}) {
  const sheetbend::Scene& topology = parts_->model().topology;
  if (!start.empty()) check_size("start", start.size(), static_cast<std::size_t>(topology.dofs()));
  check_finite("start", start);
  translated([&] {
    const double* from = start.empty() ? nullptr : start.data();
    parts_->at = EquilibriumSolver(topology).solve(parts_->inputs.data(), from, nullptr, {.held = from});
  });
  if (!parts_->at.converged) throw ConvergenceError(parts_->at.message);
}

Equilibrium::~Equilibrium() = default;
Equilibrium::Equilibrium(Equilibrium&&) noexcept = default;
Equilibrium& Equilibrium::operator=(Equilibrium&&) noexcept = default;

std::span<const double> Equilibrium::positions() const { return parts_->at.x; }
double Equilibrium::energy() const { return parts_->at.energy; }
int Equilibrium::unstable_modes() const { return parts_->at.unstable_modes; }

Gradient Equilibrium::gradient(std::span<const double> positions_bar) const {
  const Parts& p = *parts_;
  check_size("positions_bar", positions_bar.size(), p.at.x.size());
  check_finite("positions_bar", positions_bar);
  Gradient g{p.scene, std::vector<double>(p.theta.size()), std::vector<double>(p.inputs.size())};
  translated([&] { p.derivative().vjp(positions_bar.data(), nullptr, g.inputs.data()); });
  p.model().map.pull_back(p.theta.data(), g.inputs.data(), g.quantities.data());
  return g;
}

std::vector<double> Equilibrium::tangent(std::span<const double> values_dot) const {
  using D = Dual<double, 1>;
  const Parts& p = *parts_;
  check_size("values_dot", values_dot.size(), p.theta.size());
  check_finite("values_dot", values_dot);
  std::vector<D> theta(p.theta.begin(), p.theta.end()), inputs(p.inputs.size()), x(p.at.x.size());
  for (std::size_t k = 0; k < theta.size(); ++k) theta[k].d[0] = values_dot[k];
  p.model().map.apply(theta.data(), inputs.data());
  translated([&] { p.derivative().jvp(inputs.data(), x.data(), static_cast<D*>(nullptr)); });
  std::vector<double> dot;
  for (const D& a : x) dot.push_back(a.d[0]);
  return dot;
}

}  // namespace sheetbend::v0
