// The reverse of an implicit block's pairs. R has minus their forces, so K^T p = x'_bar leaves p times the derivatives of the forces to what they are
// made of: coordinates, radii and, through kappa, inverse masses.
#pragma once

#include "core/solver/pair_source.h"

namespace sheetbend {

// A pair's share along p (12): x_bar (12), and what goes to D and kappa. The forces have a potential, so what they are made of along p is how they
// change along p.
template <class S>
PairNumbers<S> meet_vjp(bool triangle, Part part, const S* x, const PairNumbers<S>& numbers, const S* p, S* x_bar,
                        S* force) {
  using D = Dual<S, 2>;
  D at[12], found[12];
  for (int d = 0; d < 12; ++d) {
    at[d] = D(x[d]);
    at[d].d[0] = p[d];
  }
  PairNumbers<D> own{D(numbers.touching), D(numbers.kappa)};
  own.touching.d[1] = S(1.0);
  meet<D>(triangle, part, at, own, found);
  PairNumbers<S> bar{S(0.0), S(0.0)};
  for (int d = 0; d < 12; ++d) {
    x_bar[d] = found[d].d[0];
    force[d] = found[d].v;
    bar.touching += p[d] * found[d].d[1];
    bar.kappa += p[d] * found[d].v;
  }
  bar.kappa = bar.kappa / numbers.kappa;
  return bar;
}

// What kappa leaves to the inverse masses (4).
template <class S>
void kappa_vjp(bool triangle, const PairNumbers<S>& numbers, double stiffness, const S& kappa_bar, S* w_bar) {
  const S all = -(kappa_bar * numbers.kappa * numbers.kappa) * S(1.0 / stiffness);
  for (int k = 0; k < 4; ++k) w_bar[k] = (triangle ? (k == 0 ? 1.0 : 1.0 / 9.0) : 0.25) * all;
}

}  // namespace sheetbend
