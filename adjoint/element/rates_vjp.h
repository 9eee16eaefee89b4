// The reverse of a = alpha/eta^2, g = alpha beta/eta on the inputs of one constraint.
#pragma once

#include "core/scene/scene.h"

namespace sheetbend {

template <class T>
void add_rates(const Inputs<const T>& in, const Group& group, int item, double eta, const T& a_bar, const T& g_bar,
               const Inputs<T>& bar) {
  const int c = group.first + item;
  T& alpha_bar = bar.of(Quantity::compliance)[c];
  alpha_bar += a_bar * T(1.0 / (eta * eta));
  if (!group.damped) return;
  const T ge = g_bar * T(1.0 / eta);
  alpha_bar += ge * in.of(Quantity::damping)[c];
  bar.of(Quantity::damping)[c] += ge * in.of(Quantity::compliance)[c];
}

// The same for all numbers of one constraint: value_bar(0) of a, (1) of g, (2 + k) of its own parameters.
template <class T, class F>
void add_values(const Inputs<const T>& in, const Group& group, int item, double eta, F&& value_bar,
                const Inputs<T>& bar) {
  add_rates(in, group, item, eta, value_bar(0), value_bar(1), bar);
  T* rest_bar = bar.of(Quantity::rest) + group.first_value + static_cast<std::size_t>(item) * group.parameters;
  for (int k = 0; k < group.parameters; ++k) rest_bar[k] += value_bar(2 + k);
}

}  // namespace sheetbend
