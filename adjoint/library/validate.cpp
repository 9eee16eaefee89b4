#include "adjoint/library/validate.h"

#include <algorithm>
#include <vector>

namespace sheetbend::library {
namespace {

// The first of the free particles that `held` does not mark, or -1.
int first_free(const Scene& scene, const std::vector<char>& held) {
  for (int n = 0; n < scene.nodes(); ++n)
    if (scene.role[n] == Role::free && !held[n]) return n;
  return -1;
}

}  // namespace

std::optional<Fault> fault_of(const Scene& scene, const ParameterMap& map) {
  std::vector<char> none(scene.nodes()), heavy(scene.nodes()), used(scene.nodes());
  if (first_free(scene, none) < 0)
    return Fault{"particles", "nothing can move: every particle is pinned or driven", "release at least one"};
  const auto mass = static_cast<int>(scene.layout.of(Quantity::mass));
  for (int n = 0; n < scene.nodes(); ++n) heavy[n] = map.terms().base[mass + n] > 0.0;
  for (const int input : map.terms().target)
    if (input >= mass && input < mass + scene.nodes()) heavy[input - mass] = true;
  if (const int n = first_free(scene, heavy); n >= 0)
    return Fault{"mass", "is zero for free particle " + std::to_string(n), "give it a mass, or pin it"};
  if (scene.groups.empty()) return {};
  for (const Group& g : scene.groups)
    for (const int n : g.stencil) used[n] = true;
  for (const Volume& v : scene.volumes)
    for (const int n : v.nodes) used[n] = true;
  if (const int n = first_free(scene, used); n >= 0)
    return Fault{"particles", "particle " + std::to_string(n) + " is connected to nothing",
                 "constrain it, pin it or leave it out"};
  return {};
}

}  // namespace sheetbend::library
