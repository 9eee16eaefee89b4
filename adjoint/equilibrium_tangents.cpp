#include "adjoint/equilibrium_tangents.h"

#include "adjoint/equilibrium_vjp.h"

namespace sheetbend {
namespace {

Equilibrium solve_or_throw(const Scene& scene, const double* inputs, const EquilibriumOptions& options, Interrupt* interrupt) {
  Equilibrium e = EquilibriumSolver(scene).solve(inputs, nullptr, nullptr, options, interrupt);
  if (!e.converged) throw NoEquilibrium(e.message);
  return e;
}

template <int N>
std::vector<Dual<double, N>> with_tangents(const Scene& scene, const Dual<double, N>* inputs, const EquilibriumOptions& options,
                                           Interrupt* interrupt) {
  std::vector<double> values(scene.layout.total());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = inputs[i].v;
  const Equilibrium e = solve_or_throw(scene, values.data(), options, interrupt);
  std::vector<Dual<double, N>> x(scene.dofs());
  EquilibriumDerivative(scene, values.data(), e).jvp(inputs, x.data(), static_cast<Dual<double, N>*>(nullptr));
  return x;
}

}  // namespace

template <>
std::vector<double> equilibrium_coordinates(const Scene& scene, const double* inputs, const EquilibriumOptions& options, Interrupt* interrupt) {
  return solve_or_throw(scene, inputs, options, interrupt).x;
}
template <>
std::vector<Dual<double, 4>> equilibrium_coordinates(const Scene& scene, const Dual<double, 4>* inputs, const EquilibriumOptions& options,
                                                     Interrupt* interrupt) {
  return with_tangents(scene, inputs, options, interrupt);
}
template <>
std::vector<Dual<double, 8>> equilibrium_coordinates(const Scene& scene, const Dual<double, 8>* inputs, const EquilibriumOptions& options,
                                                     Interrupt* interrupt) {
  return with_tangents(scene, inputs, options, interrupt);
}

}  // namespace sheetbend
