// Numbers of an experiment that are found at every theta and are no parameters of the fit (adjoint/fit/projection.h): the noise of the motion that drives a
// scene, and the places and velocities that it starts with. Each is added to inputs through fixed weights, and has a prior about zero.
#pragma once

#include <algorithm>
#include <vector>

namespace sheetbend {

struct Estimated {
  std::vector<double> sigma;  // of the prior of every number, in its unit; the last ones may be 0: they stay as given
  std::vector<double> given;  // where they start, or stay
  std::vector<int> first{0}, target;  // per number the inputs that it moves, and one past the last
  std::vector<double> weight;         // per input moved

  int count() const { return static_cast<int>(given.size()); }
  int unknowns() const { return static_cast<int>(std::find(sigma.begin(), sigma.end(), 0.0) - sigma.begin()); }

  // All numbers where the unknown ones are b (unknowns()) of their priors' deviations.
  template <class V>
  std::vector<double> at(const V& b) const {
    std::vector<double> numbers = given;
    for (int i = 0, found = unknowns(); i < found; ++i) numbers[i] = sigma[i] * b[i];
    return numbers;
  }

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
