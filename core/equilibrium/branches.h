// Soft wires and strips rest in several shapes. Solving from several starts and keeping the distinct results shows which there are.
#pragma once

#include "core/equilibrium/equilibrium.h"

namespace sheetbend {

struct Branches {
  std::vector<Equilibrium> found;     // distinct, by increasing energy
  std::vector<int> of_start;          // per start: place in `found`, or -1 where it did not converge
  std::vector<std::string> messages;  // per start: why it did not converge; empty otherwise
};

// Two results are one shape when no coordinate differs by more than `same` times the scene's size.
Branches equilibrium_branches(const Scene& scene, const double* inputs, const std::vector<std::vector<double>>& starts,
                              const EquilibriumOptions& options = {}, double same = 1e-6,
                              Interrupt* interrupt = nullptr);

}  // namespace sheetbend
