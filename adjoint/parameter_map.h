// From named physical parameters to a scene's inputs:  inputs[target] = base[target] + sum of terms coefficient * prod f_k(theta_k).
// Compliance l/EA, damping tau EI/l, mass mu l + M, a clamp's direction (cos, sin) and a rest curvature in a basis are all such sums, so
// the derivative of the map is exact and costs nothing beside a rollout. A field that must stay positive is exp(sum of weight theta), with a weight for
// each mode: a term takes one exponential for all of them, and its derivatives take time in proportion to their number.
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

// Of all functions but the exponential, whose arguments a term sums first (`ParameterMap::product`).
template <class T>
T evaluate(Factor1d f, const T& x) {
  switch (f) {
    case Factor1d::identity: return x;
    case Factor1d::inverse: return T(1.0) / x;
    case Factor1d::square: return x * x;
    case Factor1d::sine: return sin(x);
    case Factor1d::cosine: return cos(x);
    case Factor1d::root: return sqrt(x);
    case Factor1d::inverse_root: return T(1.0) / sqrt(x);
    case Factor1d::exponential: break;
    case Factor1d::over_one_plus: return T(1.0) / (T(1.0) + x);
    case Factor1d::over_one_minus_twice: return T(1.0) / (T(1.0) - T(2.0) * x);
  }
  throw std::logic_error("unknown factor of a parameter map");
}

template <class T>
T slope(Factor1d f, const T& x) {
  switch (f) {
    case Factor1d::identity: return T(1.0);
    case Factor1d::inverse: return -(T(1.0) / (x * x));
    case Factor1d::square: return T(2.0) * x;
    case Factor1d::sine: return cos(x);
    case Factor1d::cosine: return -sin(x);
    case Factor1d::root: return T(0.5) / sqrt(x);
    case Factor1d::inverse_root: return -(T(0.5) / (x * sqrt(x)));
    case Factor1d::exponential: break;
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
  std::vector<double> weight;        // per factor; counts in exponentials alone

  template <class T>
  void apply(const T* theta, T* inputs) const {
    for (std::size_t i = 0; i < base.size(); ++i) inputs[i] = T(base[i]);
    for (std::size_t t = 0; t < target.size(); ++t) inputs[target[t]] += product(t, theta);
  }

  // theta_bar += (d inputs / d theta)^T inputs_bar
  template <class T>
  void pull_back(const T* theta, const T* inputs_bar, T* theta_bar) const {
    for (std::size_t t = 0; t < target.size(); ++t) {
      const T& bar = inputs_bar[target[t]];
      const T whole = product(t, theta) * bar;
      for (int k = first_factor[t]; k < first_factor[t + 1]; ++k)
        theta_bar[parameter[k]] += function[k] == Factor1d::exponential
                                       ? weight[k] * whole
                                       : slope(function[k], theta[parameter[k]]) * product(t, theta, k) * bar;
    }
  }

 private:
  // Of term t: its coefficient times all factors but `without`, with one exponential of the sum of weight theta.
  template <class T>
  T product(std::size_t t, const T* theta, int without = -1) const {
    T found(coefficient[t]), sum(0.0);
    bool grows = false;
    for (int k = first_factor[t]; k < first_factor[t + 1]; ++k) {
      if (k == without) continue;
      if (function[k] == Factor1d::exponential) {
        sum += weight[k] * theta[parameter[k]];
        grows = true;
      } else {
        found *= evaluate(function[k], theta[parameter[k]]);
      }
    }
    return grows ? found * exp(sum) : found;
  }
};

}  // namespace sheetbend
