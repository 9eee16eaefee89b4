// Which pairs of a self-contact are near each other. By values alone; nothing of it is differentiated, and the order is that of keys.
#pragma once

#include <vector>

#include "core/contact/self_contact.h"

namespace sheetbend {

// Where the nodes are: x has `stride` numbers per node.
struct Whereabouts {
  const double* x;
  int stride;
  const double* radius;  // per node
  const double* reach;   // per node: how far it may be from there, or from a place on its way
  const double* way =
      nullptr;  // three numbers per node: where it goes from there, all in the same time; null where they stay

  const double* of(int node) const { return x + static_cast<long>(stride) * node; }
};

// The pairs that touch, or may while no node is farther than its reach from where all are at one time of their ways; sorted. Pairs that share a node never
// touch.
std::vector<PairKey> find_pairs(const SelfContact& s, const Whereabouts& at);

// The coordinates (12) of a pair's nodes.
inline void gather(const std::array<int, 4>& nodes, const double* x, int stride, double* to) {
  for (int k = 0; k < 4; ++k)
    for (int d = 0; d < 3; ++d) to[3 * k + d] = x[static_cast<long>(stride) * nodes[k] + d];
}

}  // namespace sheetbend
