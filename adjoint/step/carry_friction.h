// The reverse of CarryFriction: the cotangents of the forces that a substep leaves go through the law of contact to the state that it has found, to the one
// before and to the inputs.
#pragma once

#include "adjoint/solver/swept_contacts_vjp.h"
#include "adjoint/step/stages.h"
#include "core/step/carry_friction.h"

namespace sheetbend {

template <>
struct ReverseOf<CarryFriction> {
  template <class T>
  using Scratch = Nothing;

  template <class T>
  static void run(const Step<T>& step, const Work<T>& work, CarryFriction::Record<T>&, Nothing&,
                  const StepCotangents<T>& bar) {
    using S = Single<T>;
    const Scene& scene = step.scene;
    if (scene.contacts.empty()) return;
    const S rate(1.0 / (step.bdf.eta * step.bdf.eta));
    const Vec3<S> none(S(0.0), S(0.0), S(0.0));
    ColliderPoses<S> poses_bar;
    int lane = -1;
    std::optional<ContactSource<T>> last;
    for_each_contact(
        step, work.masses, *work.poses, [&](const ContactSource<T>& source, const auto& poses, int c, int i) {
          if (source.lane != lane) {
            if (last) poses_vjp(*last, poses_bar, bar.in);
            last.emplace(source);
            poses_bar = no_pose_cotangents(source);
            lane = source.lane;
          }
          const Contact& contact = scene.contacts[c];
          const AnyShape shape = scene.colliders[contact.collider].any();
          const Vec3<S> carried_bar = source.at(bar.x_next, contact.carried[i]), tangential_bar = rate * carried_bar;
          const auto at = [&](int node) { return source.read(Vec3<T>(work.q.of(node))); };
          const Vec3<S> x = source.point_at(contact, i, at);
          if (source.is_apart(poses.next[contact.collider], c, i, x)) return;
          const ContactNumbers<S> numbers = source.numbers(poses, c, i);
          ContactNumbers<S> numbers_bar{};
          const Vec3<S> z = poses.next[contact.collider].in_frame(x);
          Vec3<S> z_bar = touch_vjp(shape, z, numbers, none, tangential_bar, numbers_bar);
          if (value_of(numbers.leaving) != 0.0 && touch(shape, z, numbers).pushes) {
            numbers_bar.leaving += dot(normal_at(shape, z, numbers.size), carried_bar);
            z_bar = z_bar + normal_vjp(shape, z, numbers.size, numbers.leaving * carried_bar, numbers_bar.size);
          }
          point_vjp(
              source, contact, i,
              in_frame_vjp(poses.next[contact.collider], x, z_bar, poses_bar.next[contact.collider]), at,
              [&](int node) { return bar.x_next + scene.first_dof[node]; }, bar.in);
          numbers_vjp(source, poses, c, i, numbers_bar, poses_bar, bar.from, bar.in,
                      [&](int node) -> T& { return bar.w[node]; });
        });
    if (last) poses_vjp(*last, poses_bar, bar.in);
    for_each_packed(step, [&](int lane, const SweptGroup& group, std::size_t g) {
      PackedContacts& own = (*work.swept)[lane].packed[g];
      const auto x = scene_points<const T>(work.q.data, work.q.stride, lane);
      const auto x_bar = scene_points(bar.x_next, 3, lane);
      contact_kernels(scene, group)
          .carry_vjp(own.contacts(), own.carry(x, x_bar, value_of(rate)), x_bar,
                     (*bar.swept)[lane].packed[g].cotangents());
    });
    // They were written, whatever they were before.
    for (const Contact& contact : scene.contacts)
      for (int i = 0; i < contact.points(); ++i)
        if (moves(scene, contact, i)) std::fill_n(bar.x_next + scene.first_dof[contact.carried[i]], 3, T(0.0));
  }
};

}  // namespace sheetbend
