// Where the points of contacts are: weighted sums of nodes.
#pragma once

#include "core/scalar/vec3.h"
#include "core/scene/scene.h"

namespace sheetbend {

// The weight of node k of a point that several nodes carry.
template <class T>
T& weight_in(const Inputs<T>& in, const Contact& c, int item, int k) {
  return in.of(Quantity::contact_weight)[c.first_weight + static_cast<std::size_t>(c.arity) * item + k];
}

// A point of a contact, of coordinates or of velocities: at(node) are its nodes', and read(number) is an input as a number of theirs.
template <class T, class At, class Read>
auto point_of(const Contact& c, int item, const Inputs<const T>& in, At&& at, Read&& read) {
  const auto nodes = c.nodes_of(item);
  auto sum = at(nodes[0]);
  if (c.arity == 1) return sum;
  sum = read(weight_in(in, c, item, 0)) * sum;
  for (int k = 1; k < c.arity; ++k) sum = sum + read(weight_in(in, c, item, k)) * at(nodes[k]);
  return sum;
}
template <class T, class At>
auto point_of(const Contact& c, int item, const Inputs<const T>& in, At&& at) {
  return point_of(c, item, in, at, [](const T& a) { return a; });
}

}  // namespace sheetbend
