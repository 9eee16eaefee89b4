// The values of a kind's parameters that nobody gives, from the first positions of a stencil.
#pragma once

#include <algorithm>
#include <limits>

#include "core/constraints/concept.h"

namespace sheetbend {

// Kinds that measure their own parameters: static void measure(const double* x, double* p) writes those that are `measured`.
template <class K>
concept Measures = requires(const double* x, double* p) { K::measure(x, p); };

// Writes p: what a default says, and what is measured at x, so that C is zero there. Without a function of its own a kind measures by its C, from which
// measured parameters are subtracted, the last ones from the first rows. A value that has to be given is NaN.
template <class K>
void rest_values(const double* x, double* p) {
  constexpr int P = parameter_count<K>;
  constexpr int measured = static_cast<int>(
      std::ranges::count(K::parameters, Source::measured, [](const Parameter& a) { return a.otherwise.source; }));
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  for (int k = 0; k < P; ++k) {
    const Default& otherwise = K::parameters[k].otherwise;
    p[k] = otherwise.source == Source::usual || otherwise.source == Source::preset ? otherwise.value : none;
  }
  if constexpr (measured > 0 && Measures<K>) {
    K::measure(x, p);
  } else if constexpr (measured > 0) {
    static_assert(measured <= K::rows && K::parameters[P - measured].otherwise.source == Source::measured,
                  "measured parameters come last and are subtracted from the first rows; else write measure(x, p)");
    std::fill_n(p + P - measured, measured, 0.0);
    std::copy_n(SharedEvaluation<K, double>(x, p).C, measured, p + P - measured);
  }
}

}  // namespace sheetbend
