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

}  // namespace sheetbend
