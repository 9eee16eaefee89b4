// The equilibrium of a scene over the scalars of a fit: the double solution, with tangents by the implicit function theorem.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "core/equilibrium/equilibrium.h"

namespace sheetbend {

// No equilibrium was found from the given start.
struct NoEquilibrium : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Coordinates (dofs) of the equilibrium that the start Quantity::position leads to. Throws NoEquilibrium. T: double, Dual<double, 4>, Dual<double, 8>.
template <class T>
std::vector<T> equilibrium_coordinates(const Scene& scene, const T* inputs, const EquilibriumOptions& options, Interrupt* interrupt);

}  // namespace sheetbend
