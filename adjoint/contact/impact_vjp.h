// The reverse of an impact (core/contact/impact.h), over duals with a few of its numbers' directions at a time. Cotangents stand in objects of
// the same types.
#pragma once

#include "core/contact/impact.h"
#include "core/contact/touch.h"

namespace sheetbend {

// Adds to the cotangents of the surface and returns those of the flight before, given those of the flight after.
template <class S>
Flight<S> bounced_vjp(const ImpactRule& rule, const Flight<S>& flight, const Surface<S>& surface, double guess,
                      const Flight<S>& after_bar, Surface<S>& surface_bar) {
  constexpr int before = Flight<S>::numbers, all = before + Surface<S>::numbers, directions = 11;
  static_assert(all % directions == 0);
  using D = Dual<S, directions>;
  S given[all], seed[before], bar[all];
  int i = 0;
  const auto read = [&](const S& a) { given[i++] = a; };
  Flight<S>::each(flight, read), Surface<S>::each(surface, read);
  i = 0;
  Flight<S>::each(after_bar, [&](const S& a) { seed[i++] = a; });
  for (int first = 0; first < all; first += directions) {
    Flight<D> f;
    Surface<D> s;
    i = 0;
    const auto direct = [&](D& a) {
      a = D(given[i]);
      if (i >= first && i < first + directions) a.d[i - first] = S(1.0);
      ++i;
    };
    Flight<D>::each(f, direct), Surface<D>::each(s, direct);
    const Flight<D> after = bounced(rule, f, s, guess);
    for (int k = 0; k < directions; ++k) bar[first + k] = S(0.0);
    i = 0;
    Flight<D>::each(after, [&](const D& a) {
      for (int k = 0; k < directions; ++k) bar[first + k] += seed[i] * a.d[k];
      ++i;
    });
  }
  Flight<S> flight_bar;
  i = 0;
  Flight<S>::each(flight_bar, [&](S& a) { a = bar[i++]; });
  Surface<S>::each(surface_bar, [&](S& a) { a += bar[i++]; });
  return flight_bar;
}

extern template Flight<double> bounced_vjp(const ImpactRule&, const Flight<double>&, const Surface<double>&, double,
                                           const Flight<double>&, Surface<double>&);

}  // namespace sheetbend
