// Which pairs of a self-contact are near each other. By values alone; nothing of it is differentiated, and the order is that of keys.
#pragma once

#include <vector>

#include "core/contact/self_contact.h"

namespace sheetbend {

// Where the spots are: x has `stride` numbers per spot.
struct Whereabouts {
  const double* x;
  int stride;
  const double* radius;  // per spot
  const double* reach;   // per spot: how far it may be from there, or from a place on its way
  const double* way =
      nullptr;  // three numbers per spot: where it goes from there, all in the same time; null where they stay

  const double* of(int spot) const { return x + static_cast<long>(stride) * spot; }
};

// The pairs that touch, or may while no spot is farther than its reach from where all are at one time of their ways; sorted. Pairs that share a node, or that
// are of one body, never touch.
std::vector<PairKey> find_pairs(const SelfContact& s, const Whereabouts& at);

// The coordinates (12) of a pair's spots.
inline void gather(const std::array<int, 4>& spots, const double* x, int stride, double* to) {
  for (int k = 0; k < 4; ++k)
    for (int d = 0; d < 3; ++d) to[3 * k + d] = x[static_cast<long>(stride) * spots[k] + d];
}

}  // namespace sheetbend
