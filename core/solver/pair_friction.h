// What friction between an implicit block's pairs reads of a substep, over any scalar, of one of a pack's scenes: the coefficient, where slip is counted
// from, and the tangential forces that pairs of the substep before carry on, by key.
#pragma once

#include <algorithm>

#include "core/contact/meeting.h"
#include "core/contact/spots.h"
#include "core/solver/contact_source.h"
#include "core/solver/plan.h"

namespace sheetbend {

template <class S>
struct PairFriction {
  S friction{};
  std::vector<PairKey> keys;     // sorted
  std::vector<Vec3<S>> carried;  // per key, in multipliers
  std::vector<S> from;           // history of the block's particles (particles, 3)

  void resize(const DirectBlock& block) {
    if (!block.surface.rubs()) return;
    keys.reserve(block.surface.carried.size());
    carried.reserve(block.surface.carried.size());
    from.assign(3 * block.particles.size(), S(0.0));
  }
  static std::size_t bytes(const DirectBlock& block) {
    if (!block.surface.rubs()) return 0;
    return (sizeof(PairKey) + sizeof(Vec3<S>)) * block.surface.carried.size() + sizeof(S) * 3 * block.particles.size();
  }

  template <class T>
  void load(const ContactSource<T>& source, const DirectBlock& block) {
    if (!block.surface.rubs()) return;
    friction = source.read(source.in.of(Quantity::friction)[block.surface.friction]);
    for (std::size_t p = 0; p < block.particles.size(); ++p) {
      const int node = block.particles[p];
      Vec3<S> history = S(source.bdf.now) * source.at(source.from.x, node);
      if (source.bdf.before != 0.0) history = history + S(source.bdf.before) * source.at(source.from.x_before, node);
      history.store(&from[3 * p]);
    }
    keys.clear();
    carried.clear();
    for (const auto& [key, force] : block.surface.carried) {
      const Vec3<S> code = source.at(source.from.x, key);
      if (!is_coded(value_of(code.x))) break;
      keys.push_back(decoded(value_of(code.x), value_of(code.y), value_of(code.z)));
      carried.push_back(S(source.bdf.eta * source.bdf.eta) * source.at(source.from.x, force));
    }
  }

  Vec3<S> history(int particle) const { return Vec3<S>(&from[3 * static_cast<std::size_t>(particle)]); }
  // Where a pair's force stands; -1 where it carries none.
  int place_of(const PairKey& key) const {
    const auto at = std::ranges::lower_bound(keys, key);
    return at != keys.end() && *at == key ? static_cast<int>(at - keys.begin()) : -1;
  }
  Rub<S> of(const PairKey& key, const std::array<int, 4>& pair, const Spots<S>& spots) const {
    Rub<S> rub{friction, {S(0.0), S(0.0), S(0.0)}, {}};
    if (const int place = place_of(key); place >= 0) rub.carried = carried[place];
    for (int k = 0; k < 4; ++k) spots.at(pair[k], [&](int p) { return history(p); }).store(rub.from + 3 * k);
    return rub;
  }
};

// The values of what a scalar carries more than a value of.
template <class S>
void take_values(const PairFriction<S>& f, PairFriction<double>& all) {
  all.friction = value_of(f.friction);
  all.keys = f.keys;
  all.carried.clear();
  for (const Vec3<S>& c : f.carried) all.carried.push_back({value_of(c.x), value_of(c.y), value_of(c.z)});
  for (std::size_t i = 0; i < f.from.size(); ++i) all.from[i] = value_of(f.from[i]);
}

}  // namespace sheetbend
