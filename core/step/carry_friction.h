// The tangential forces of contacts at the end of a substep, f = lambda_t/eta^2 in the collider's frame, at the state that the substep has found: the next
// substep begins with them. They stand in the coordinates of pinned nodes, so that tape, checkpoints and restarts have them as they have any other coordinate.
#pragma once

#include "core/step/stages.h"

namespace sheetbend {

// Calls f(source, poses, contact, item) for every contact of a movable particle, one scene of a pack after the other.
template <class T, class F>
void for_each_contact(const Step<T>& step, const InverseMasses<T>& masses, F&& f) {
  if (step.scene.contacts.empty()) return;
  for (int lane = 0; lane < (std::is_same_v<T, Pack> ? Pack::lanes : 1); ++lane) {
    const ContactSource<T> source = contact_source(step, masses, lane);
    const auto poses = source.poses();
    for (int c = 0; c < static_cast<int>(step.scene.contacts.size()); ++c)
      for (int i = 0; i < static_cast<int>(step.scene.contacts[c].particles.size()); ++i)
        if (step.scene.role[step.scene.contacts[c].particles[i]] == Role::free) f(source, poses, c, i);
  }
}

struct CarryFriction {
  static constexpr bool repeated = false;
  template <class T>
  using Record = Nothing;

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Nothing&) {
    const Scene& scene = step.scene;
    const double rate = 1.0 / (step.bdf.eta * step.bdf.eta);
    for_each_contact(step, work.masses, [&](const auto& source, const auto& poses, int c, int i) {
      using S = Single<T>;
      const Contact& contact = scene.contacts[c];
      const auto z = poses.next[contact.collider].in_frame(source.at(work.x_next, contact.particles[i]));
      const auto found = touch(scene.colliders[contact.collider].shape, z, source.numbers(poses, c, i));
      source.write(S(rate) * found.tangential, work.x_next + scene.first_dof[contact.carried[i]]);
    });
  }
};

}  // namespace sheetbend
