// The reverse of contacts at rest: what the forces on points say about the inputs.
#pragma once

#include "adjoint/solver/contact_source_vjp.h"
#include "core/equilibrium/resting.h"

namespace sheetbend {

// Adds to the cotangents of the inputs and of the coordinates `held` (dofs) that friction counts from, given those of the forces at x (dofs).
inline void resting_vjp(const RestingContacts<double>& contacts, const double* x, const double* force_bar,
                        double* held_bar, const Inputs<double>& bar) {
  if (contacts.items.empty()) return;
  const ContactSource<double>& source = *contacts.source;
  const Vec3<double> none(0.0, 0.0, 0.0);
  ColliderPoses<double> poses_bar = no_pose_cotangents(source);
  std::vector<double> velocities_bar(source.scene.dofs()), w_bar(source.scene.nodes(), 0.0);
  for (const auto& i : contacts.items) {
    const Pose<double>& pose = contacts.pose(i);
    const Vec3<double> z = contacts.in_frame(i, x);
    const Touch<double> t = touch(i.shape, z, i.numbers);
    if (!t.pushes) continue;
    Pose<double>& pose_bar = poses_bar.next[source.scene.contacts[i.contact].collider];
    const Contact& contact = contacts.contact(i);
    const auto weights_take = [&](const Vec3<double>& own, const double* of) {
      weights_vjp(source, contact, i.item, own, [&](int node) { return source.at(of, node); }, bar);
    };
    weights_take((1.0 / RestingContacts<double>::per_force) * pose.turned(t.force), force_bar);
    const Vec3<double> world = (1.0 / RestingContacts<double>::per_force) * source.point(contact, i.item, force_bar);
    ContactNumbers<double> numbers_bar{};
    const Vec3<double> z_bar =
        touch_vjp(i.shape, z, i.numbers, turned_vjp(pose, t.force, world, pose_bar), none, numbers_bar);
    const Vec3<double> point_bar = in_frame_vjp(pose, source.point(contact, i.item, x), z_bar, pose_bar);
    weights_take(point_bar, x);
    if (!i.rubs) numbers_bar.friction = 0.0, numbers_bar.carried = none;
    numbers_vjp(source, contacts.poses, i.contact, i.item, numbers_bar, poses_bar,
                {held_bar, nullptr, velocities_bar.data(), nullptr}, bar, [&](int n) -> double& { return w_bar[n]; });
  }
  for (int n = 0; n < source.scene.nodes(); ++n)
    if (w_bar[n] != 0.0) bar.of(Quantity::mass)[n] -= w_bar[n] * source.w[n] * source.w[n];
  for (std::size_t c = 0; c < poses_bar.next.size(); ++c) {  // `held` is seen from the same poses
    Pose<double>&to = poses_bar.next[c], &from = poses_bar.now[c];
    to.position = to.position + from.position;
    for (int k = 0; k < 9; ++k) to.turn[k] += from.turn[k];
    from = {};
  }
  poses_vjp(source, poses_bar, bar);
}

}  // namespace sheetbend
