// The reverse of contacts between sweeps. Of x = y + w F(x) with the cotangents x_bar and F_bar,
//
//   s = (I - w dF/dx)^-T (F_bar + w x_bar),   y_bar = x_bar + (dF/dx)^T s,   and s goes through F to what the law reads;
//
// y = x_before - w F_before leaves -w y_bar to the force of the pass before. w and s are in the world's frame, the law in the collider's.
#pragma once

#include "adjoint/solver/contact_source_vjp.h"
#include "core/solver/swept_contacts.h"

namespace sheetbend {

// Cotangents of one scene's SweptContacts.
template <class S>
struct SweptContactCotangents {
  std::vector<ContactNumbers<S>> numbers;  // per contact of the plan
  std::vector<Vec3<S>> force;              // likewise, of the pass at hand
  std::vector<Pose<S>> poses;              // at n+1, per collider

  void resize(const Scene& scene, const Plan& plan) {
    numbers.resize(plan.contacts.size());
    force.resize(plan.contacts.size());
    poses.resize(scene.colliders.size());
  }
  static std::size_t bytes(const Scene& scene, const Plan& plan) {
    return (sizeof(ContactNumbers<S>) + sizeof(Vec3<S>)) * plan.contacts.size() +
           sizeof(Pose<S>) * scene.colliders.size();
  }
  void clear() {
    std::fill(numbers.begin(), numbers.end(), ContactNumbers<S>{});
    std::fill(force.begin(), force.end(), Vec3<S>{});
    std::fill(poses.begin(), poses.end(), Pose<S>{});
  }
};

// s = (I - w dF/dx)^-T b. A second pass carries what a larger scalar has beside its values.
template <class S>
Vec3<S> transposed_balance(const AnyShape& shape, const Pose<S>& pose, const Vec3<S>& x, const S& w,
                           const ContactNumbers<S>& numbers, const Touch<S>& at, const Vec3<S>& b) {
  const Inverse3 inverse = balance_inverse(shape, values_of(pose.in_frame(x)), value_of(w), values_of(numbers));
  const auto solved = [&](const Vec3<S>& v) { return pose.turned(inverse.transposed_times(pose.turned_back(v))); };
  const Vec3<S> s = solved(b);
  ContactNumbers<S> unused{};
  Pose<S> unused_pose{};
  return s + solved(b - s + w * push_vjp(shape, pose, x, numbers, at, s, unused, unused_pose));
}

// Reverse of project_contacts(): q_bar goes from the cotangent of the coordinates after a pass to that of those before; w_bar is added to.
template <class T>
void project_contacts_vjp(const ContactSource<T>& source, const Plan& plan, int iteration,
                          SweptContacts<Single<T>>& contacts, const Coordinates<T>& q_bar, T* w_bar,
                          SweptContactCotangents<Single<T>>& bar) {
  using S = Single<T>;
  for (int i = static_cast<int>(plan.contacts.size()) - 1; i >= 0; --i) {
    const SweptContact& c = plan.contacts[i];
    const auto &push = contacts.push(iteration, i), &before = contacts.before(iteration, i);
    if (!push.pushes && !before.pushes) continue;
    T* to = q_bar.of(c.node);
    const Vec3<S> x_bar = source.read(Vec3<T>(to));
    const S w = source.read(source.w[c.node]);
    Vec3<S> y_bar = x_bar;
    S own_w_bar(0.0);
    if (push.pushes) {
      const Pose<S>& pose = contacts.poses.next[c.collider];
      const ContactNumbers<S>& numbers = contacts.numbers[i];
      const Touch<S> at = touch(c.shape, pose.in_frame(push.x), numbers);
      const Vec3<S> s = transposed_balance(c.shape, pose, push.x, w, numbers, at, bar.force[i] + w * x_bar);
      y_bar = x_bar + push_vjp(c.shape, pose, push.x, numbers, at, s, bar.numbers[i], bar.poses[c.collider]);
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
}

// What has gathered goes on, at the end of a substep's reverse.
template <class T>
void spread_contacts(const ContactSource<T>& source, const Plan& plan, const SweptContacts<Single<T>>& contacts,
                     const SweptContactCotangents<Single<T>>& bar, const StateCotangents<T>& from_bar,
                     const Inputs<T>& in_bar, T* w_bar) {
  auto poses_bar = no_pose_cotangents(source);
  poses_bar.next = bar.poses;
  for (std::size_t i = 0; i < plan.contacts.size(); ++i)
    if (contacts.near[i])
      numbers_vjp(source, contacts.poses, plan.contacts[i].contact, plan.contacts[i].item, bar.numbers[i], poses_bar,
                  from_bar, in_bar, [&](int node) -> T& { return w_bar[node]; });
  poses_vjp(source, poses_bar, in_bar);
}

}  // namespace sheetbend
