// From named physical parameters to a scene's inputs:  inputs[target] = base[target] + sum of terms coefficient * prod f_k(theta_k).
// Compliance l/EA, damping tau EI/l, mass mu l + M, a clamp's direction (cos, sin) and a rest curvature in a basis are all such sums, so
// the derivative of the map is exact and costs nothing beside a rollout. A field that must stay positive is exp(sum of weight theta), with a weight for
// each mode: a term takes one exponential for all of them, and its derivatives take time in proportion to their number.
// A factor may be an intermediate value in place of a parameter, which is such a sum itself, of terms that come before. The body at the end of a chain of joints
// starts where the body above it lets it be: written out, its place has a term for each choice of sine or cosine along the chain.
#pragma once

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <utility>
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

// Of all functions but the exponential, whose arguments a term sums first (`ParameterMap::product_without`).
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

// The terms as files and Python hold them.
struct ParameterTerms {
  std::vector<double> base;          // one per input
  std::vector<int> target;           // per term; intermediate value k is -1 - k
  std::vector<double> coefficient;   // per term
  std::vector<int> first_factor{0};  // per term, and one past the last
  std::vector<int> parameter;        // per factor; intermediate value k is -1 - k
  std::vector<Factor1d> function;    // per factor
  std::vector<double> weight;        // per factor; counts in exponentials alone

  int factors_of(std::size_t term) const { return first_factor[term + 1] - first_factor[term]; }
  int intermediates() const { return target.empty() ? 0 : std::max(0, -*std::ranges::min_element(target)); }
  // Whether each intermediate value is made by some term, and complete before another one is made of it.
  bool in_order() const {
    const int made = intermediates();
    std::vector<bool> used(made, false), has_term(made, false);
    for (const int input : target)
      if (input < 0) has_term[-1 - input] = true;
    if (!std::ranges::all_of(has_term, std::identity())) return false;
    for (std::size_t t = 0; t < target.size(); ++t) {
      for (int k = first_factor[t]; k < first_factor[t + 1]; ++k) {
        if (parameter[k] >= 0) continue;
        if (-1 - parameter[k] >= made) return false;
        if (target[t] < 0) used[-1 - parameter[k]] = true;
      }
      if (target[t] < 0 && used[-1 - target[t]]) return false;
    }
    return true;
  }
  bool same_factors(std::size_t s, std::size_t t) const {
    const auto alike = [&](const auto& of) {
      const auto first = of.begin() + first_factor[s];
      return std::equal(first, first + factors_of(s), of.begin() + first_factor[t]);
    };
    return factors_of(s) == factors_of(t) && alike(parameter) && alike(function) && alike(weight);
  }
};

// Terms that follow each other with the same factors share their product: a mode of a rope has one product and a coefficient at
// each link, and a rope of 48 links with all that the recipe may fit has 69,000 terms and 219 products.
class ParameterMap {
 public:
  ParameterMap() = default;
  explicit ParameterMap(ParameterTerms terms) : terms_(std::move(terms)) {
    product_.reserve(terms_.target.size());
    for (std::size_t t = 0; t < terms_.target.size(); ++t) {
      if (t == 0 || !terms_.same_factors(t - 1, t)) term_.push_back(t);
      product_.push_back(static_cast<int>(term_.size()) - 1);
      if (terms_.target[t] < 0) makes_.push_back(t);
    }
    intermediates_ = terms_.intermediates();
  }

  const ParameterTerms& terms() const { return terms_; }

  // Adds inputs that are zero.
  void extend(std::size_t inputs) { terms_.base.resize(terms_.base.size() + inputs); }

  template <class T>
  void apply(const T* theta, T* inputs) const {
    const Known<T> known = known_with(theta);
    std::vector<T> products;
    products.reserve(term_.size());
    for (const std::size_t t : term_) products.push_back(product_without(known, t, -1));
    for (std::size_t i = 0; i < terms_.base.size(); ++i) inputs[i] = T(terms_.base[i]);
    for (std::size_t t = 0; t < product_.size(); ++t)
      if (terms_.target[t] >= 0) inputs[terms_.target[t]] += terms_.coefficient[t] * products[product_[t]];
  }

  // theta_bar += (d inputs / d theta)^T inputs_bar
  template <class T>
  void pull_back(const T* theta, const T* inputs_bar, T* theta_bar) const {
    const Known<T> known = known_with(theta);
    std::vector<T> products_bar(term_.size(), T(0.0)), intermediate_bar(known.intermediate.size(), T(0.0));
    for (std::size_t t = 0; t < product_.size(); ++t)
      if (terms_.target[t] >= 0) products_bar[product_[t]] += terms_.coefficient[t] * inputs_bar[terms_.target[t]];
    const auto pull = [&](std::size_t term, const T& product_bar) {
      const T whole = product_without(known, term, -1) * product_bar;
      for (int k = terms_.first_factor[term]; k < terms_.first_factor[term + 1]; ++k) {
        const int j = terms_.parameter[k];
        (j < 0 ? intermediate_bar[-1 - j] : theta_bar[j]) +=
            terms_.function[k] == Factor1d::exponential
                ? terms_.weight[k] * whole
                : slope(terms_.function[k], known[j]) * product_without(known, term, k) * product_bar;
      }
    };
    for (std::size_t p = 0; p < term_.size(); ++p) pull(term_[p], products_bar[p]);
    for (auto t = makes_.rbegin(); t != makes_.rend(); ++t)
      pull(*t, terms_.coefficient[*t] * intermediate_bar[-1 - terms_.target[*t]]);
  }

 private:
  // Parameters, and the intermediate values that are made of them.
  template <class T>
  struct Known {
    const T* theta;
    std::vector<T> intermediate;
    const T& operator[](int j) const { return j < 0 ? intermediate[-1 - j] : theta[j]; }
  };

  template <class T>
  Known<T> known_with(const T* theta) const {
    Known<T> known{theta, std::vector<T>(intermediates_, T(0.0))};
    for (const std::size_t t : makes_)
      known.intermediate[-1 - terms_.target[t]] += terms_.coefficient[t] * product_without(known, t, -1);
    return known;
  }

  // The product of a term's factors but one, with one exponential of the sum of weight theta.
  template <class T>
  T product_without(const Known<T>& theta, std::size_t term, int factor) const {
    T found(1.0), sum(0.0);
    bool grows = false;
    for (int k = terms_.first_factor[term]; k < terms_.first_factor[term + 1]; ++k) {
      if (k == factor) continue;
      if (terms_.function[k] == Factor1d::exponential) {
        sum += terms_.weight[k] * theta[terms_.parameter[k]];
        grows = true;
      } else {
        found *= evaluate(terms_.function[k], theta[terms_.parameter[k]]);
      }
    }
    return grows ? found * exp(sum) : found;
  }

  ParameterTerms terms_;
  std::vector<int> product_;        // per term
  std::vector<std::size_t> term_;   // per product, the first that has it
  std::vector<std::size_t> makes_;  // the terms of intermediate values
  int intermediates_ = 0;
};

}  // namespace sheetbend
