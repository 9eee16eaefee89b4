// Where a contact begins in a substep: its point is inside the surface at the end, or as low as restitution lifts it, and was not inside at the
// start. By values, of which nothing is differentiated. A contact so soft that substeps follow its vibration is a force as others are, and does not count.
#pragma once

#include "core/step/step.h"

namespace sheetbend {

// omega h of such a contact, at most; omega^2: its stiffness times the inverse mass of its point.
inline constexpr double followed = 0.5;

template <class T>
Scenes where_contact_begins(const Step<T>& step, const InverseMasses<T>& masses,
                            const std::vector<ColliderPoses<Single<T>>>& colliders, const T* x_next,
                            const std::vector<SweptContacts<Single<T>>>& swept) {
  const Scene& scene = step.scene;
  Scenes begun = 0;
  for (int lane = 0; lane < static_cast<int>(colliders.size()); ++lane) {
    if (!has(step.scenes, lane)) continue;
    const auto source = contact_source(step, masses, lane);
    const auto is_followed = [&](const Contact& c, int item) {
      if (c.stiffness < 0) return false;
      const double stiffness = value_of(source.read(step.in.of(Quantity::contact_stiffness)[c.stiffness]));
      return stiffness * value_of(source.inverse_mass(c, item)) * source.h * source.h <= followed * followed;
    };
    const auto& poses = colliders[lane];
    const auto begins = [&](const Contact& c, int contact, int item) {
      double above = 0.0;
      if (c.rebounds(item))
        if (const auto r = source.rebound(poses, contact, item); r.lifts) above = value_of(r.lift);
      return moves(scene, c, item) && !is_followed(c, item) &&
             value_of(source.gap(poses.next[c.collider], contact, source.point(c, item, x_next))) < above &&
             !(value_of(source.gap(poses.now[c.collider], contact, source.point(c, item, step.from.x))) < 0.0);
    };
    // Kernels look at places alone; whether a soft contact is followed depends on each particle's mass.
    const auto any_begins = [&](int contact) {
      const Contact& c = scene.contacts[contact];
      if constexpr (std::is_same_v<Single<T>, double>)
        for (std::size_t g = 0; c.stiffness < 0 && g < step.plan.contact_groups.size(); ++g)
          if (const SweptGroup& group = step.plan.contact_groups[g]; group.contact == contact && group.packed())
            return contact_kernels(scene, group)
                .begins(swept[lane].packed[g].contacts(), scene_points(x_next, 3, lane));
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

// Where a ball was hit that constraints hold. They pull it as if a contact had begun.
template <class T>
Scenes where_held_balls_hit(const Step<T>& step, const std::vector<Impact<Single<T>>>& impacts) {
  Scenes hit = 0;
  for (const auto& impact : impacts)
    for (const auto& f : impact.flown())
      if (f.ball >= 0 && step.scene.balls.held[f.ball]) hit |= static_cast<Scenes>(1u << impact.lane);
  return hit & step.scenes;
}

}  // namespace sheetbend
