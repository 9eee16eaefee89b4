// Recorded motion that drives a scene is as noisy as what is compared. Its correction: numbers that are added to the boundary's knots through
// fixed weights. An errors-in-variables fit estimates them beside the parameters (adjoint/fit/projection.h).
#pragma once

#include <vector>

namespace sheetbend {

struct BoundaryCorrection {
  double sigma = 0.0;                 // of the prior of every number [m]; 0: they are not estimated
  std::vector<double> given;          // where they start, or stay [m]
  std::vector<int> first{0}, target;  // per number the inputs that it moves, and one past the last
  std::vector<double> weight;         // per input moved

  int count() const { return static_cast<int>(given.size()); }
  int unknowns() const { return sigma > 0.0 ? count() : 0; }

  // Adds number i.
  template <class T>
  void apply(int i, const T& b, T* inputs) const {
    for (int k = first[i]; k < first[i + 1]; ++k) inputs[target[k]] += T(weight[k]) * b;
  }

  template <class T>
  void apply(const T* b, T* inputs) const {
    for (int i = 0; i < count(); ++i) apply(i, b[i], inputs);
  }

  // b_bar += the transpose of `apply`.
  void pull_back(const double* inputs_bar, double* b_bar) const {
    for (int i = 0; i < count(); ++i)
      for (int k = first[i]; k < first[i + 1]; ++k) b_bar[i] += weight[k] * inputs_bar[target[k]];
  }
};

}  // namespace sheetbend
