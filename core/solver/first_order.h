// Which substeps go with BDF1 where the solver's formula is BDF2: the first one, three from where a contact begins, and the one after a bounce, which begins
// anew as the first one does. BDF2 goes through an impact as
// if nothing had happened, and bounces. Three substeps: the velocity of the first carries the rest of the impact, and the fourth is the first
// whose states are all clean of it. Each scene of a pack has its own.
#pragma once

#include <algorithm>
#include <array>

#include "core/scene/scene.h"
#include "core/solver/options.h"
#include "core/solver/scenes.h"

namespace sheetbend {

// Whether this is such a solver of such a scene.
inline bool changes_at_contacts(const Scene& scene, const SolverOptions& o) {
  return o.integrator == Integrator::bdf2 &&
         (!scene.contacts.empty() || !scene.self_contact.empty() || !scene.balls.empty());
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
