#include "adjoint/equilibrium_tangents.h"

#include "core/scalar/dual.h"

namespace sheetbend {
namespace {

Equilibrium solve_or_throw(const Scene& scene, const double* inputs, const EquilibriumOptions& options, Interrupt* interrupt) {
  EquilibriumSolver solver(scene);
  Equilibrium e = solver.solve(inputs, nullptr, nullptr, options, interrupt);
  if (!e.converged) throw NoEquilibrium(e.message);
  return e;
}

}  // namespace

template <>
std::vector<double> equilibrium_coordinates<double>(const Scene& scene, const double* inputs, const EquilibriumOptions& options,
                                                    Interrupt* interrupt) {
  return solve_or_throw(scene, inputs, options, interrupt).x;
}

template <int N>
std::vector<Dual<double, N>> tangents(const Scene&, const Dual<double, N>*, const EquilibriumOptions&, Interrupt*) {
  throw NoEquilibrium("tangents are not there yet");
}

template <>
std::vector<Dual<double, 4>> equilibrium_coordinates<Dual<double, 4>>(const Scene& s, const Dual<double, 4>* in, const EquilibriumOptions& o,
                                                                      Interrupt* i) {
  return tangents<4>(s, in, o, i);
}
template <>
std::vector<Dual<double, 8>> equilibrium_coordinates<Dual<double, 8>>(const Scene& s, const Dual<double, 8>* in, const EquilibriumOptions& o,
                                                                      Interrupt* i) {
  return tangents<8>(s, in, o, i);
}

}  // namespace sheetbend
