#include "adjoint/equilibrium/equilibrium_tangents.h"

#include "adjoint/equilibrium/equilibrium_vjp.h"

namespace sheetbend {

template void EquilibriumDerivative::jvp(const Dual<double, 1>*, Dual<double, 1>*, Dual<double, 1>*) const;
template void EquilibriumDerivative::jvp(const Dual<double, 4>*, Dual<double, 4>*, Dual<double, 4>*) const;
template void EquilibriumDerivative::jvp(const Dual<double, 8>*, Dual<double, 8>*, Dual<double, 8>*) const;

Equilibrium EquilibriumAnchor::solve(const Scene& scene, const double* inputs, const EquilibriumOptions& options,
                                     Interrupt* interrupt) {
  EquilibriumSolver solver(scene);
  // Inputs that an optimizer tries may make a start infinite: no answer, as any other start that leads nowhere.
  const auto from = [&](const double* x, const double* lambda) {
    try {
      return solver.solve(inputs, x, lambda, options, interrupt);
    } catch (const std::invalid_argument& error) {
      Equilibrium none;
      none.message = error.what();
      return none;
    }
  };
  std::unique_lock lock(setting_);
  const bool known = set_;
  lock.unlock();
  if (known) {  // never written again
    Equilibrium near = from(x_.data(), lambda_.data());
    if (near.converged) return near;
  }
  Equilibrium e = from(nullptr, nullptr);
  if (!e.converged) throw NoEquilibrium(e.message);
  lock.lock();
  if (!set_) {
    x_ = e.x;
    lambda_ = e.lambda;
    set_ = true;
  }
  return e;
}

namespace {

template <int N>
std::vector<Dual<double, N>> with_tangents(const Scene& scene, const Dual<double, N>* inputs,
                                           const EquilibriumOptions& options, EquilibriumAnchor& anchor,
                                           Interrupt* interrupt) {
  std::vector<double> values(scene.layout.total());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = inputs[i].v;
  const Equilibrium e = anchor.solve(scene, values.data(), options, interrupt);
  std::vector<Dual<double, N>> x(scene.dofs());
  EquilibriumDerivative(scene, values.data(), e).jvp(inputs, x.data(), static_cast<Dual<double, N>*>(nullptr));
  return x;
}

}  // namespace

template <>
std::vector<double> equilibrium_coordinates(const Scene& scene, const double* inputs, const EquilibriumOptions& options,
                                            EquilibriumAnchor& anchor, Interrupt* interrupt) {
  return anchor.solve(scene, inputs, options, interrupt).x;
}
template <>
std::vector<Dual<double, 4>> equilibrium_coordinates(const Scene& scene, const Dual<double, 4>* inputs,
                                                     const EquilibriumOptions& options, EquilibriumAnchor& anchor,
                                                     Interrupt* interrupt) {
  return with_tangents(scene, inputs, options, anchor, interrupt);
}
template <>
std::vector<Dual<double, 8>> equilibrium_coordinates(const Scene& scene, const Dual<double, 8>* inputs,
                                                     const EquilibriumOptions& options, EquilibriumAnchor& anchor,
                                                     Interrupt* interrupt) {
  return with_tangents(scene, inputs, options, anchor, interrupt);
}

}  // namespace sheetbend
