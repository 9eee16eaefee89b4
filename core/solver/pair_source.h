// The numbers of an implicit block's pairs over any scalar: where they are, radii, masses and what friction reads, of one of a pack's scenes.
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
  Spots<S> spots;

  PairSource(const SubstepState<T>& s_, const DirectBlock& block_, const BlockPairs& pairs_,
             const PairFriction<S>& friction_, int lane_)
      : s(s_),
        block(block_),
        pairs(pairs_),
        friction(friction_),
        lane(lane_),
        spots(block_.surface, [&](std::size_t i) { return read(s.inputs.of(Quantity::contact_weight)[i]); }) {}

  S read(const T& a) const { return in_scene(a, lane); }
  int second_side(const BlockPair& pair) const { return pair.key.triangle ? 1 : 2; }  // where it begins
  int radius_of(const BlockPair& pair, int k) const { return block.surface.radius[pair.spots[k]]; }
  S inverse_mass(int particle) const {
    return particle < block.movable ? read(s.w[block.particles[particle]]) : S(0.0);
  }

  PairNumbers<S> numbers(const BlockPair& pair) const {
    const T* radius = s.inputs.of(Quantity::contact_radius);
    S w[4];
    for (int k = 0; k < 4; ++k)
      w[k] = spots.inverse_mass(pair.spots[k], [&](int particle) { return inverse_mass(particle); });
    return pair_numbers(pair.key.triangle, read(radius[radius_of(pair, 0)]),
                        read(radius[radius_of(pair, second_side(pair))]), w, pairs.stiffness);
  }

  // Where a spot is, or what else of the particles sums up there.
  template <class At>
  Vec3<S> place(int spot, At&& rows) const {
    return spots.at(spot, [&](int particle) {
      const auto* at = rows(particle);
      return Vec3<S>(read(at[0]), read(at[1]), read(at[2]));
    });
  }

  // Calls f(pair, part, x, numbers, rub) for each that touches, the block's particles being at rows(particle) (3 of a T); `rub` is null without friction.
  template <class F, class At>
  void for_each_touching(At&& rows, F&& f) const {
    for (const BlockPair& pair : pairs.all()) {
      S x[12];
      double at[12];
      for (int k = 0; k < 4; ++k) place(pair.spots[k], rows).store(x + 3 * k);
      for (int d = 0; d < 12; ++d) at[d] = value_of(x[d]);
      if (!touches(pair.key.triangle, at, pair.numbers)) continue;
      const Part part = nearest_part(pair.key.triangle, at, softness_of(pair.numbers));
      Rub<S> rub;
      if (block.surface.rubs()) rub = friction.of(pair.key, pair.spots, spots);
      f(pair, part, x, numbers(pair), block.surface.rubs() ? &rub : nullptr);
    }
  }
};

}  // namespace sheetbend
