// Checks that the parts of a scene share, with the words in which they refuse.
#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace sheetbend {

[[noreturn]] inline void refuse(const std::string& message) { throw std::invalid_argument(message); }

inline void check_nodes(const std::string& field, const std::vector<int>& nodes, int count) {
  for (const int node : nodes)
    if (node < 0 || node >= count)
      refuse(field + ": particle " + std::to_string(node) + " does not exist. Fix: use 0 to " +
             std::to_string(count - 1));
}

inline void check_knots(const std::string& field, const Knots& knots, bool needed) {
  if (needed && knots.times.empty()) refuse(field + ": no knot times. Fix: give at least one");
  for (std::size_t i = 1; i < knots.times.size(); ++i)
    if (!(knots.times[i] > knots.times[i - 1]))
      refuse(field + ": time " + std::to_string(knots.times[i]) + " at knot " + std::to_string(i) +
             " does not increase. Fix: sort the knots");
}

// Where each particle stands in a list, -1 where it does not.
inline std::vector<int> slots(const std::vector<int>& list, int count, const std::string& field) {
  std::vector<int> slot(count, -1);
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (slot[list[i]] >= 0)
      refuse(field + ": particle " + std::to_string(list[i]) + " is listed twice. Fix: list it once");
    slot[list[i]] = static_cast<int>(i);
  }
  return slot;
}

// What a node is that is no place.
inline std::string a_direction(const Scene& scene, int node) {
  return scene.is_director[node] ? "a director" : "an axis of a body";
}

inline void check_triangles(const std::string& field, const std::vector<std::array<int, 3>>& triangles,
                            const Scene& scene) {
  for (const auto& [a, b, c] : triangles) {
    check_nodes(field, {a, b, c}, scene.nodes());
    const std::string which = std::to_string(a) + ", " + std::to_string(b) + ", " + std::to_string(c);
    if (a == b || b == c || c == a)
      refuse(field + ": triangle " + which + " has no area. Fix: give distinct particles");
    for (const int n : {a, b, c})
      if (!scene.is_place[n])
        refuse(field + ": triangle " + which + " holds " + a_direction(scene, n) + ". Fix: use particles");
  }
}

}  // namespace sheetbend
