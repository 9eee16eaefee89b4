// The reverse of contacts between sweeps, x = y + w F(x) by adjoint/contact/push_out_vjp.h; y = x_before - w F_before leaves -w y_bar to the force of the
// pass before.
#pragma once

#include "adjoint/contact/push_out_vjp.h"
#include "adjoint/solver/contact_source_vjp.h"
#include "adjoint/solver/packed_contacts_vjp.h"
#include "core/solver/swept_contacts.h"

namespace sheetbend {

// Cotangents of one scene's SweptContacts. Zero where a substep's reverse begins.
template <class S>
struct SweptContactCotangents {
  std::vector<ContactNumbers<S>> numbers;  // per contact that goes alone
  std::vector<Vec3<S>> force;              // likewise, of the pass at hand
  std::vector<Pose<S>> poses;              // at n+1, per collider
  std::vector<PackedContactCotangents> packed;

  void resize(const Scene& scene, const Plan& plan) {
    const std::size_t own = SweptContacts<S>::one_by_one(plan);
    numbers.resize(own);
    force.resize(own);
    poses.resize(scene.colliders.size());
    packed.resize(plan.contact_groups.size());
    for (std::size_t g = 0; g < packed.size(); ++g)
      if (goes_in_packs<S>(plan.contact_groups[g])) packed[g].resize(plan.contact_groups[g]);
    clear();
  }
  static std::size_t bytes(const Scene& scene, const Plan& plan) {
    std::size_t sum = (sizeof(ContactNumbers<S>) + sizeof(Vec3<S>)) * SweptContacts<S>::one_by_one(plan) +
                      sizeof(Pose<S>) * scene.colliders.size() +
                      sizeof(PackedContactCotangents) * plan.contact_groups.size();
    for (const SweptGroup& group : plan.contact_groups)
      if (goes_in_packs<S>(group)) sum += PackedContactCotangents::bytes(group);
    return sum;
  }
  void clear() {
    std::fill(numbers.begin(), numbers.end(), ContactNumbers<S>{});
    std::fill(force.begin(), force.end(), Vec3<S>{});
    std::fill(poses.begin(), poses.end(), Pose<S>{});
    for (PackedContactCotangents& own : packed) own.clear();
  }
};

// Reverse of project_contact().
template <class T>
void project_contact_vjp(const ContactSource<T>& source, const Plan& plan, int iteration, int i,
                         SweptContacts<Single<T>>& contacts, const Coordinates<T>& q_bar, T* w_bar,
                         SweptContactCotangents<Single<T>>& bar) {
  using S = Single<T>;
  const SweptContact& c = plan.contacts[i];
  const auto &push = contacts.push(iteration, i), &before = contacts.before(iteration, i);
  if (!push.pushes && !before.pushes) return;
  T* to = q_bar.of(c.node);
  const Vec3<S> x_bar = source.read(Vec3<T>(to));
  const S w = source.read(source.w[c.node]);
  Vec3<S> y_bar = x_bar;
  S own_w_bar(0.0);
  if (push.pushes) {
    y_bar = x_bar + push_out_vjp(c.shape, contacts.poses.next[c.collider], push.x, w, contacts.numbers[i],
                                 bar.force[i] + w * x_bar, bar.numbers[i], bar.poses[c.collider]);
    own_w_bar += dot(push.force, y_bar);
  }
  bar.force[i] = Vec3<S>(S(0.0), S(0.0), S(0.0));
  if (before.pushes) {
    own_w_bar -= dot(before.force, y_bar);
    bar.force[i] = -(w * y_bar);
  }
  source.add(own_w_bar, w_bar[c.node]);
  source.write(y_bar, to);
}

// Reverse of project_contacts(): q_bar goes from the cotangent of the coordinates after a pass to that of those before; w_bar is added to.
template <class T>
void project_contacts_vjp(const ContactSource<T>& source, const Plan& plan, int iteration,
                          SweptContacts<Single<T>>& contacts, const Coordinates<T>& q_bar, T* w_bar,
                          SweptContactCotangents<Single<T>>& bar) {
  for (int g = static_cast<int>(plan.contact_groups.size()) - 1; g >= 0; --g) {
    const SweptGroup& group = plan.contact_groups[g];
    if constexpr (std::is_same_v<Single<T>, double>)
      if (group.packed()) {
        PackedContacts& own = contacts.packed[g];
        contact_kernels(source.scene, group)
            .project_vjp(own.contacts(), own.pass(iteration, scene_points(q_bar.data, q_bar.stride, source.lane)),
                         bar.packed[g].cotangents());
        continue;
      }
    for (int i = group.first + group.count - 1; i >= group.first; --i)
      project_contact_vjp(source, plan, iteration, i, contacts, q_bar, w_bar, bar);
  }
}

// What has gathered goes on at the end of a substep's reverse; `bar` is zero again after it.
template <class T>
void spread_contacts(const ContactSource<T>& source, const Plan& plan, const SweptContacts<Single<T>>& contacts,
                     SweptContactCotangents<Single<T>>& bar, const StateCotangents<T>& from_bar,
                     const Inputs<T>& in_bar, T* w_bar) {
  auto poses_bar = no_pose_cotangents(source);
  poses_bar.next = bar.poses;
  for (std::size_t g = 0; g < plan.contact_groups.size(); ++g) {
    const SweptGroup& group = plan.contact_groups[g];
    if constexpr (std::is_same_v<Single<T>, double>)
      if (group.packed()) {
        bar.packed[g].spread(source, group, contacts.packed[g], from_bar, in_bar, w_bar, poses_bar);
        continue;
      }
    for (int i = group.first; i < group.first + group.count; ++i)
      if (contacts.near[i])
        numbers_vjp(source, contacts.poses, plan.contacts[i].contact, plan.contacts[i].item, bar.numbers[i], poses_bar,
                    from_bar, in_bar, [&](int node) -> T& { return w_bar[node]; });
  }
  poses_vjp(source, poses_bar, in_bar);
  bar.clear();
}

}  // namespace sheetbend
