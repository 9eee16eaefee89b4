// The reverse of a collision of two balls (core/contact/collision.h), over duals with a few of its numbers' directions at a time.
#pragma once

#include "core/contact/collision.h"
#include "core/contact/touch.h"

namespace sheetbend {

// Cotangents of a pair, given those of both flights after it.
template <class S>
BallPair<S> collided_vjp(const ImpactRule& rule, const BallPair<S>& pair, const BallMeeting& meeting,
                         const std::array<Flight<S>, 2>& after_bar) {
  constexpr int all = BallPair<S>::numbers, flight = Flight<S>::numbers, directions = 8;
  using D = Dual<S, directions>;
  const int count = pair.count();
  S given[all], seed[2 * flight], bar[all];
  int i = 0;
  BallPair<S>::each(pair, [&](const S& a) { given[i++] = a; });
  i = 0;
  for (const Flight<S>& own : after_bar) Flight<S>::each(own, [&](const S& a) { seed[i++] = a; });
  for (int first = 0; first < count; first += directions) {
    const int some = std::min(directions, count - first);
    BallPair<D> p;
    p.joined = pair.joined, p.linked = pair.linked;
    i = 0;
    BallPair<D>::each(p, [&](D& a) {
      a = D(given[i]);
      if (i >= first && i < first + some) a.d[i - first] = S(1.0);
      ++i;
    });
    for (int k = 0; k < some; ++k) bar[first + k] = S(0.0);
    i = 0;
    for (const Flight<D>& after : collided(rule, p, meeting))
      Flight<D>::each(after, [&](const D& a) {
        for (int k = 0; k < some; ++k) bar[first + k] += seed[i] * a.d[k];
        ++i;
      });
  }
  BallPair<S> pair_bar;
  pair_bar.joined = pair.joined;
  i = 0;
  BallPair<S>::each(pair_bar, [&](S& a) { a = bar[i++]; });
  return pair_bar;
}

// Compiled once (contact_vjp.cpp), for scenes by themselves and in lanes.
extern template BallPair<double> collided_vjp(const ImpactRule&, const BallPair<double>&, const BallMeeting&,
                                              const std::array<Flight<double>, 2>&);

}  // namespace sheetbend
