// Where a contact begins in a substep: its point is inside the surface at the end, or as low as restitution lifts it, and was not inside at the
// start. By values, of which nothing is differentiated.
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
    const auto begins = [&](const Contact& c, int contact, int item) {
      double above = 0.0;
      if (c.rebounds(item))
        if (const auto r = source.rebound(poses, contact, item); r.lifts) above = value_of(r.lift);
      return moves(scene, c, item) &&
             value_of(source.gap(poses.next[c.collider], contact, source.point(c, item, x_next))) < above &&
             !(value_of(source.gap(poses.now[c.collider], contact, source.point(c, item, step.from.x))) < 0.0);
    };
    const auto any_begins = [&](int contact) {
      const Contact& c = scene.contacts[contact];
      for (int item = 0; item < c.points(); ++item)
        if (begins(c, contact, item)) return true;
      return false;
    };
    for (int contact = 0; contact < static_cast<int>(scene.contacts.size()); ++contact)
      if (any_begins(contact)) {
        begun |= static_cast<Scenes>(1u << lane);
        break;
      }
  }
  return begun;
}

}  // namespace sheetbend
