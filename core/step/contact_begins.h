// Where a contact begins in a substep: its particle is inside the surface at the end, and was not at the start. By values, of which nothing is
// differentiated.
#pragma once

#include "core/step/step.h"

namespace sheetbend {

template <class T>
Scenes where_contact_begins(const Step<T>& step, const T* x_next) {
  const Scene& scene = step.scene;
  Scenes begun = 0;
  for (int lane = 0; lane < scenes_of<T>; ++lane) {
    if (!has(step.scenes, lane)) continue;
    const ContactSource<T> source{scene, step.in, step.bdf, step.t_next, step.plan.options.h, step.from, nullptr, lane};
    const auto poses = source.poses();
    const auto begins = [&](const Contact& c, int contact, int node) {
      return value_of(source.gap(poses.next[c.collider], contact, source.at(x_next, node))) < 0.0 &&
             !(value_of(source.gap(poses.now[c.collider], contact, source.at(step.from.x, node))) < 0.0);
    };
    for (int i = 0; i < static_cast<int>(scene.contacts.size()); ++i)
      if (const Contact& c = scene.contacts[i]; std::any_of(c.particles.begin(), c.particles.end(), [&](int node) {
            return scene.role[node] == Role::free && begins(c, i, node);
          })) {
        begun |= static_cast<Scenes>(1u << lane);
        break;
      }
  }
  return begun;
}

}  // namespace sheetbend
