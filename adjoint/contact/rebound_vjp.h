// The reverse of a rebound (core/contact/rebound.h), over duals with a few of its numbers' directions at a time. Cotangents stand in objects of the same types.
#pragma once

#include "core/contact/rebound.h"
#include "core/contact/touch.h"

namespace sheetbend {

// Cotangents of what a rebound reads, given those of what it gives.
template <class S>
Falling<S> rebound_vjp(const AnyShape& shape, double h, bool impacts, const Falling<S>& falling,
                       const Rebound<S>& bar) {
  constexpr int all = Falling<S>::numbers, directions = 11;
  static_assert(all % directions == 0);
  using D = Dual<S, directions>;
  S given[all], seed[Rebound<S>::numbers], back[all];
  int i = 0;
  Falling<S>::each(falling, [&](const S& a) { given[i++] = a; });
  i = 0;
  Rebound<S>::each(bar, [&](const S& a) { seed[i++] = a; });
  for (int first = 0; first < all; first += directions) {
    Falling<D> f;
    i = 0;
    Falling<D>::each(f, [&](D& a) {
      a = D(given[i]);
      if (i >= first && i < first + directions) a.d[i - first] = S(1.0);
      ++i;
    });
    for (int k = 0; k < directions; ++k) back[first + k] = S(0.0);
    i = 0;
    const Rebound<D> found = rebound(shape, h, impacts, f);
    Rebound<D>::each(found, [&](const D& a) {
      for (int k = 0; k < directions; ++k) back[first + k] += seed[i] * a.d[k];
      ++i;
    });
  }
  Falling<S> falling_bar;
  i = 0;
  Falling<S>::each(falling_bar, [&](S& a) { a = back[i++]; });
  return falling_bar;
}

extern template Falling<double> rebound_vjp(const AnyShape&, double, bool, const Falling<double>&,
                                            const Rebound<double>&);

}  // namespace sheetbend
