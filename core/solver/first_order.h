// Which substeps go with BDF1 where the solver's formula is BDF2: the first one, three from where a contact begins, and the one after a bounce, which begins
// anew as the first one does. BDF2 goes through an impact as
// if nothing had happened, and bounces. Three substeps: the velocity of the first carries the rest of the impact, and the fourth is the first
// whose states are all clean of it. Each scene of a pack has its own.
#pragma once

#include <algorithm>
#include <array>
#include <type_traits>

#include "core/scalar/pack.h"
#include "core/scene/scene.h"
#include "core/solver/options.h"

namespace sheetbend {

// Whether this is such a solver of such a scene.
inline bool changes_at_contacts(const Scene& scene, const SolverOptions& o) {
  return o.integrator == Integrator::bdf2 &&
         (!scene.contacts.empty() || !scene.self_contact.empty() || !scene.balls.empty());
}

// Scenes of a T: the lanes of a pack, otherwise one.
template <class T>
inline constexpr int scenes_of = std::is_same_v<T, Pack> ? Pack::lanes : 1;

// Some of them, a bit each.
using Scenes = unsigned char;
static_assert(Pack::lanes <= 8);

template <class T>
inline constexpr Scenes all_scenes = static_cast<Scenes>((1u << scenes_of<T>)-1u);

inline bool has(Scenes scenes, int scene) { return (scenes >> scene & 1) != 0; }

// a in some scenes, b in the others.
template <class T>
T chosen(Scenes scenes, const T& a, const T& b) {
  if constexpr (std::is_same_v<T, Pack>) {
    T mixed = b;
    for (int scene = 0; scene < Pack::lanes; ++scene)
      if (has(scenes, scene)) mixed.set(scene, a[scene]);
    return mixed;
  } else {
    return scenes ? a : b;
  }
}

// How many substeps of BDF1 each scene has before it since a contact began, or one since a particle bounced, which has no history then. Part of a state.
template <class T>
class AfterImpact {
 public:
  Scenes scenes() const {
    Scenes some = 0;
    for (int scene = 0; scene < scenes_of<T>; ++scene)
      if (left_[scene] > 0) some |= static_cast<Scenes>(1u << scene);
    return some;
  }
  // After a substep in which contacts began, and particles bounced, in these scenes.
  void count(Scenes began, Scenes bounced) {
    for (int scene = 0; scene < scenes_of<T>; ++scene) {
      const int left = left_[scene] - (left_[scene] > 0);
      left_[scene] = static_cast<unsigned char>(has(began, scene) ? 2 : std::max(left, has(bounced, scene) ? 1 : 0));
    }
  }

 private:
  std::array<unsigned char, scenes_of<T>> left_{};
};

}  // namespace sheetbend
