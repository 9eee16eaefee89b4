#include "core/equilibrium/branches.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace sheetbend {
namespace {

// Largest difference of a coordinate, relative to the largest extent along an axis (dofs are x, y, z in turn).
double relative_distance(const std::vector<double>& a, const std::vector<double>& b) {
  double distance = 0.0, extent = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    double low = a[axis], high = a[axis];
    for (std::size_t i = axis; i < a.size(); i += 3) {
      distance = std::max(distance, std::abs(a[i] - b[i]));
      low = std::min(low, a[i]);
      high = std::max(high, a[i]);
    }
    extent = std::max(extent, high - low);
  }
  return extent > 0.0 ? distance / extent : distance;
}

}  // namespace

Branches equilibrium_branches(const Scene& scene, const double* inputs, const std::vector<std::vector<double>>& starts,
                              const EquilibriumOptions& options, double same, Interrupt* interrupt) {
  for (std::size_t i = 0; i < starts.size(); ++i)
    if (starts[i].size() != static_cast<std::size_t>(scene.dofs()))
      throw std::invalid_argument("starts: start " + std::to_string(i) + " has " + std::to_string(starts[i].size()) +
                                  " coordinates. Fix: give " + std::to_string(scene.dofs()));
  EquilibriumSolver solver(scene);
  Branches branches;
  std::vector<Equilibrium>& found = branches.found;
  for (const auto& start : starts) {
    Equilibrium e = solver.solve(inputs, start.data(), nullptr, options, interrupt);
    branches.messages.push_back(e.message);
    branches.of_start.push_back(-1);
    if (!e.converged) continue;
    const auto known = std::find_if(found.begin(), found.end(),
                                    [&](const Equilibrium& other) { return relative_distance(other.x, e.x) <= same; });
    branches.of_start.back() = static_cast<int>(known - found.begin());
    if (known == found.end()) found.push_back(std::move(e));
  }

  std::vector<int> order(found.size()), place(found.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return found[a].energy < found[b].energy; });
  std::vector<Equilibrium> sorted;
  for (std::size_t i = 0; i < order.size(); ++i) {
    place[order[i]] = static_cast<int>(i);
    sorted.push_back(std::move(found[order[i]]));
  }
  found = std::move(sorted);
  for (int& branch : branches.of_start)
    if (branch >= 0) branch = place[branch];
  return branches;
}

}  // namespace sheetbend
