// The equilibrium of a scene over the scalars of a fit: the double solution, with tangents by the implicit function theorem.
#pragma once

#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/equilibrium/equilibrium.h"
#include "core/scalar/dual.h"

namespace sheetbend {

// No equilibrium was found from the given start.
struct NoEquilibrium : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Where the solves of one experiment begin: the first one where its start Quantity::position is, all later ones at the solution of the
// first. That saves most of their iterations and keeps them on its branch. They remain functions of their inputs, whatever was solved in
// between and by which thread.
class EquilibriumAnchor {
 public:
  // Throws NoEquilibrium.
  Equilibrium solve(const Scene& scene, const double* inputs, const EquilibriumOptions& options, Interrupt* interrupt);

 private:
  std::mutex setting_;
  bool set_ = false;
  std::vector<double> x_, lambda_;
};

// Coordinates (dofs) of the equilibrium. Throws NoEquilibrium. T: double, Dual<double, 4>, Dual<double, 8>.
template <class T>
std::vector<T> equilibrium_coordinates(const Scene& scene, const T* inputs, const EquilibriumOptions& options,
                                       EquilibriumAnchor& anchor, Interrupt* interrupt);

template <>
std::vector<double> equilibrium_coordinates(const Scene&, const double*, const EquilibriumOptions&, EquilibriumAnchor&,
                                            Interrupt*);
template <>
std::vector<Dual<double, 4>> equilibrium_coordinates(const Scene&, const Dual<double, 4>*, const EquilibriumOptions&,
                                                     EquilibriumAnchor&, Interrupt*);
template <>
std::vector<Dual<double, 8>> equilibrium_coordinates(const Scene&, const Dual<double, 8>*, const EquilibriumOptions&,
                                                     EquilibriumAnchor&, Interrupt*);

}  // namespace sheetbend
