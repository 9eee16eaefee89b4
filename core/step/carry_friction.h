// The tangential forces of contacts at the end of a substep, f = lambda_t/eta^2 in the collider's frame, at the state that the substep has found, and along
// the normal what restitution has left to give back (core/contact/rebound.h): the next substep begins with them. They stand in the coordinates of pinned
// nodes, so that tape, checkpoints and restarts have them as they have any other coordinate.
#pragma once

#include "core/step/stages.h"

namespace sheetbend {

// Calls f(source, poses, contact, item) for every contact of a movable point, one of the step's scenes after the other; not for those that go in packs.
template <class T, class F>
void for_each_contact(const Step<T>& step, const InverseMasses<T>& masses,
                      const std::vector<ColliderPoses<Single<T>>>& poses, F&& f) {
  const auto in_packs = [&](int c) {
    return std::ranges::any_of(step.plan.contact_groups, [&](const SweptGroup& group) {
      return group.contact == c && goes_in_packs<Single<T>>(group);
    });
  };
  if (step.scene.contacts.empty() || all_go_in_packs<Single<T>>(step.plan)) return;
  for (int lane = 0; lane < scenes_of<T>; ++lane) {
    if (!has(step.scenes, lane)) continue;
    const ContactSource<T> source = contact_source(step, masses, lane);
    for (int c = 0; c < static_cast<int>(step.scene.contacts.size()); ++c) {
      if (in_packs(c)) continue;
      for (int i = 0; i < step.scene.contacts[c].points(); ++i)
        if (moves(step.scene, step.scene.contacts[c], i)) f(source, poses[lane], c, i);
    }
  }
}

// Likewise f(lane, group, g) for every group of contacts that goes in packs.
template <class T, class F>
void for_each_packed(const Step<T>& step, F&& f) {
  if constexpr (std::is_same_v<Single<T>, double>)
    for (int lane = 0; lane < scenes_of<T>; ++lane)
      for (std::size_t g = 0; has(step.scenes, lane) && g < step.plan.contact_groups.size(); ++g)
        if (step.plan.contact_groups[g].packed()) f(lane, step.plan.contact_groups[g], g);
}

// What a point does at a collider in a substep.
enum class ContactMode : char { apart, sticks, slides };

struct CarryFriction {
  static constexpr bool repeated = false;

  // What each point of each contact did last, contact after contact; in a pack one scene after the other.
  template <class T>
  struct Record {
    std::vector<ContactMode> modes;

    void resize(const Scene& scene, const Plan&, bool reversed) {
      if (!reversed) modes.assign(scenes_of<T> * points_in_contact(scene), ContactMode::apart);
    }
    static std::size_t bytes(const Scene& scene, const Plan&, bool reversed) {
      return reversed ? 0 : scenes_of<T> * points_in_contact(scene);
    }
  };

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Record<T>& record) {
    const Scene& scene = step.scene;
    const double rate = 1.0 / (step.bdf.eta * step.bdf.eta);
    const std::size_t count = points_in_contact(scene);
    for_each_contact(step, work.masses, *work.poses, [&](const auto& source, const auto& poses, int c, int i) {
      using S = Single<T>;
      const Contact& contact = scene.contacts[c];
      const auto x = source.point(contact, i, work.x_next);
      ContactMode& mode = record.modes[source.lane * count + contact.first + i];
      T* const kept = work.x_next + scene.first_dof[contact.carried[i]];
      if (source.is_apart(poses.next[contact.collider], c, i, x)) {
        mode = ContactMode::apart;
        return source.write(Vec3<S>(S(0.0), S(0.0), S(0.0)), kept);
      }
      const auto z = poses.next[contact.collider].in_frame(x);
      const AnyShape shape = scene.colliders[contact.collider].any();
      const auto numbers = source.numbers(poses, c, i);
      const auto found = touch(shape, z, numbers);
      auto carried = S(rate) * found.tangential;
      if (found.pushes && contact.rebounds(i)) carried = carried + numbers.leaving * normal_at(shape, z, numbers.size);
      source.write(carried, kept);
      mode = !found.pushes ? ContactMode::apart : found.slides ? ContactMode::slides : ContactMode::sticks;
    });
    for_each_packed(step, [&](int lane, const SweptGroup& group, std::size_t g) {
      PackedContacts& own = (*work.swept)[lane].packed[g];
      contact_kernels(scene, group)
          .carry(own.contacts(),
                 own.carry(scene_points<const T>(work.x_next, 3, lane), scene_points(work.x_next, 3, lane), rate));
      const Contact& contact = scene.contacts[group.contact];
      for (int i = 0; i < group.count; ++i)
        record.modes[lane * count + contact.first + step.plan.contacts[group.first + i].item] =
            static_cast<ContactMode>(own.modes()[i]);
    });
  }
};

}  // namespace sheetbend
