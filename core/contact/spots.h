// Where the corners of what touches itself are, and what acts on them does: a spot is a node, or a point of a body, which is a weighted sum of four nodes.
#pragma once

#include "core/contact/self_contact.h"
#include "core/scalar/vec3.h"

namespace sheetbend {

template <class S>
struct Spots {
  int nodes = 0;                              // a spot below this number is that node
  std::vector<std::array<int, 4>> on_bodies;  // of the others
  std::vector<std::array<S, 4>> weights;      // likewise

  Spots() = default;
  // weight(i): number i of those in the order of Quantity::contact_weight, from the first one of spots on.
  template <class Weight>
  Spots(const SelfContact& s, Weight&& weight) : nodes(s.nodes), on_bodies(s.on_bodies), weights(s.on_bodies.size()) {
    for (std::size_t i = 0; i < 4 * weights.size(); ++i) weights[i / 4][i % 4] = weight(s.first_weight + i);
  }

  bool is_node(int spot) const { return spot < nodes; }
  // Where the weights of a point of a body begin, four for each.
  std::size_t first_weight(int spot) const { return is_node(spot) ? 0 : 4 * static_cast<std::size_t>(spot - nodes); }

  // Calls f(node, weight) for all nodes of a spot.
  template <class F>
  void for_each_node(int spot, F&& f) const {
    if (is_node(spot)) return f(spot, S(1.0));
    for (int k = 0; k < 4; ++k) f(on_bodies[spot - nodes][k], weights[spot - nodes][k]);
  }
  // Where a spot is, nodes being at(node).
  template <class At>
  Vec3<S> at(int spot, At&& at_node) const {
    if (is_node(spot)) return at_node(spot);
    const auto& node = on_bodies[spot - nodes];
    const auto& weight = weights[spot - nodes];
    Vec3<S> sum = weight[0] * at_node(node[0]);
    for (int k = 1; k < 4; ++k) sum = sum + weight[k] * at_node(node[k]);
    return sum;
  }
  // sum b^2 w of nodes with the inverse masses w(node).
  template <class W>
  S inverse_mass(int spot, W&& w) const {
    if (is_node(spot)) return w(spot);
    S sum(0.0);
    for_each_node(spot, [&](int node, const S& b) { sum += b * b * w(node); });
    return sum;
  }
};

}  // namespace sheetbend
