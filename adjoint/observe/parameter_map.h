// From named physical parameters to a scene's inputs:  inputs[target] = base[target] + sum of terms coefficient * prod f_k(theta_k).
// Compliance l/EA, damping tau EI/l, mass mu l + M, a clamp's direction (cos, sin) and a rest curvature in a basis are all such sums, so
// the derivative of the map is exact and costs nothing beside a rollout. A field that must stay positive is a product of exponentials
// exp(weight theta), one per mode.
#pragma once

#include <stdexcept>
#include <vector>

#include "core/scalar/dual.h"

namespace sheetbend {

enum class Factor1d : int {
  identity,
  inverse,
  square,
  sine,
  cosine,
  root,
  inverse_root,
  exponential,
  over_one_plus,        // 1/(1 + x) and
  over_one_minus_twice  // 1/(1 - 2 x): of Poisson's number, in Lame's constants
};
inline constexpr int factor_count = static_cast<int>(Factor1d::over_one_minus_twice) + 1;

inline double exp(double a) { return std::exp(a); }
template <class T, int N>
Dual<T, N> exp(const Dual<T, N>& a) {
  const T e = exp(a.v);
  return Dual<T, N>::map(a, e, e);
}

// The weight counts in exponentials alone.
template <class T>
T evaluate(Factor1d f, const T& x, double weight) {
  switch (f) {
    case Factor1d::identity: return x;
    case Factor1d::inverse: return T(1.0) / x;
    case Factor1d::square: return x * x;
    case Factor1d::sine: return sin(x);
    case Factor1d::cosine: return cos(x);
    case Factor1d::root: return sqrt(x);
    case Factor1d::inverse_root: return T(1.0) / sqrt(x);
    case Factor1d::exponential: return exp(weight * x);
    case Factor1d::over_one_plus: return T(1.0) / (T(1.0) + x);
    case Factor1d::over_one_minus_twice: return T(1.0) / (T(1.0) - T(2.0) * x);
  }
  throw std::logic_error("unknown factor of a parameter map");
}

template <class T>
T slope(Factor1d f, const T& x, double weight) {
  switch (f) {
    case Factor1d::identity: return T(1.0);
    case Factor1d::inverse: return -(T(1.0) / (x * x));
    case Factor1d::square: return T(2.0) * x;
    case Factor1d::sine: return cos(x);
    case Factor1d::cosine: return -sin(x);
    case Factor1d::root: return T(0.5) / sqrt(x);
    case Factor1d::inverse_root: return -(T(0.5) / (x * sqrt(x)));
    case Factor1d::exponential: return weight * exp(weight * x);
    case Factor1d::over_one_plus: return -(T(1.0) / ((T(1.0) + x) * (T(1.0) + x)));
    case Factor1d::over_one_minus_twice: return T(2.0) / ((T(1.0) - T(2.0) * x) * (T(1.0) - T(2.0) * x));
  }
  throw std::logic_error("unknown factor of a parameter map");
}

struct ParameterMap {
  std::vector<double> base;          // one per input
  std::vector<int> target;           // per term
  std::vector<double> coefficient;   // per term
  std::vector<int> first_factor{0};  // per term, and one past the last
  std::vector<int> parameter;        // per factor
  std::vector<Factor1d> function;    // per factor
  std::vector<double> weight;        // per factor

  template <class T>
  void apply(const T* theta, T* inputs) const {
    for (std::size_t i = 0; i < base.size(); ++i) inputs[i] = T(base[i]);
    for (std::size_t t = 0; t < target.size(); ++t) {
      T product(coefficient[t]);
      for (int k = first_factor[t]; k < first_factor[t + 1]; ++k)
        product *= evaluate(function[k], theta[parameter[k]], weight[k]);
      inputs[target[t]] += product;
    }
  }

  // theta_bar += (d inputs / d theta)^T inputs_bar
  template <class T>
  void pull_back(const T* theta, const T* inputs_bar, T* theta_bar) const {
    for (std::size_t t = 0; t < target.size(); ++t)
      for (int k = first_factor[t]; k < first_factor[t + 1]; ++k) {
        T product = T(coefficient[t]) * slope(function[k], theta[parameter[k]], weight[k]) * inputs_bar[target[t]];
        for (int j = first_factor[t]; j < first_factor[t + 1]; ++j)
          if (j != k) product *= evaluate(function[j], theta[parameter[j]], weight[j]);
        theta_bar[parameter[k]] += product;
      }
  }
};

}  // namespace sheetbend
