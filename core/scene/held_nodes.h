// Which nodes of a scene constraints hold.
#pragma once

#include <vector>

#include "core/scene/scene.h"

namespace sheetbend {

// Per node.
inline std::vector<char> held_nodes(const Scene& s) {
  std::vector<char> held(s.nodes(), false);
  for (const Group& g : s.groups)
    for (const int n : g.stencil) held[n] = true;
  for (const Volume& v : s.volumes)
    for (const int n : v.nodes) held[n] = true;
  return held;
}

}  // namespace sheetbend
