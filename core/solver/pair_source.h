// The numbers of an implicit block's pairs over any scalar: radii, masses and what friction reads, of one of a pack's scenes.
#pragma once

#include "core/solver/block_pairs.h"
#include "core/solver/pair_friction.h"
#include "core/solver/placed.h"

namespace sheetbend {

template <class T>
struct PairSource {
  using S = Single<T>;
  const SubstepState<T>& s;
  const DirectBlock& block;
  const BlockPairs& pairs;
  const PairFriction<S>& friction;
  int lane;

  S read(const T& a) const {
    if constexpr (std::is_same_v<T, Pack>)
      return a[lane];
    else
      return a;
  }
  int second_side(const BlockPair& pair) const { return pair.key.triangle ? 1 : 2; }  // where it begins
  int radius_of(const BlockPair& pair, int k) const { return block.surface.radius[pair.particles[k]]; }

  PairNumbers<S> numbers(const BlockPair& pair) const {
    const T* radius = s.inputs.of(Quantity::contact_radius);
    S w[4];
    for (int k = 0; k < 4; ++k) {
      const int p = pair.particles[k];
      w[k] = p < block.movable ? read(s.w[block.particles[p]]) : S(0.0);
    }
    return pair_numbers(pair.key.triangle, read(radius[radius_of(pair, 0)]),
                        read(radius[radius_of(pair, second_side(pair))]), w, pairs.stiffness);
  }

  // Calls f(pair, part, x, numbers, rub) for each that touches, its nodes being at rows(particle) (3 of a T); `rub` is null without friction.
  template <class F, class At>
  void for_each_touching(At&& rows, F&& f) const {
    for (const BlockPair& pair : pairs.all()) {
      S x[12];
      double at[12];
      for (int d = 0; d < 12; ++d) {
        x[d] = read(rows(pair.particles[d / 3])[d % 3]);
        at[d] = value_of(x[d]);
      }
      if (!touches(pair.key.triangle, at, pair.numbers)) continue;
      const Part part = nearest_part(pair.key.triangle, at, softness_of(pair.numbers));
      Rub<S> rub;
      if (block.surface.rubs()) rub = friction.of(pair.key, pair.particles);
      f(pair, part, x, numbers(pair), block.surface.rubs() ? &rub : nullptr);
    }
  }
};

}  // namespace sheetbend
