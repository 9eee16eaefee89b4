// The reverse of an implicit block's contacts. R has minus their forces, so K^T p = x'_bar leaves p times the derivatives of the forces to what they
// are made of.
#pragma once

#include "adjoint/solver/contact_source_vjp.h"
#include "core/solver/block_contacts.h"

namespace sheetbend {

// Cotangents of one scene's BlockContacts.
template <class S>
struct BlockContactCotangents {
  std::vector<ContactNumbers<S>> numbers;
  std::vector<std::array<S, most_point_nodes>> weights;
  std::vector<Pose<S>> poses;  // at n+1, per collider

  void resize(const Scene& scene, const DirectBlock& block) {
    if (block.contacts.empty()) return;
    numbers.resize(block.contacts.size());
    weights.resize(block.contacts.size());
    poses.resize(scene.colliders.size());
  }
  static std::size_t bytes(const Scene& scene, const DirectBlock& block) {
    if (block.contacts.empty()) return 0;
    return (sizeof(ContactNumbers<S>) + sizeof(S) * most_point_nodes) * block.contacts.size() +
           sizeof(Pose<S>) * scene.colliders.size();
  }
  void clear() {
    std::fill(numbers.begin(), numbers.end(), ContactNumbers<S>{});
    std::fill(weights.begin(), weights.end(), std::array<S, most_point_nodes>{});
    std::fill(poses.begin(), poses.end(), Pose<S>{});
  }

  // Contact i with its point at x, along p: returns what goes to x, and the force in `force`, both in the world's frame.
  Vec3<S> pull_back(const DirectBlock& block, const BlockContacts<S>& contacts, int i, const Vec3<S>& x,
                    const Vec3<S>& p, Vec3<S>& force) {
    const BlockContact& own = block.contacts[i];
    const Pose<S>& pose = contacts.pose(block, i);
    const Touch<S> at = touch(own.shape, pose.in_frame(x), contacts.numbers[i]);
    force = Vec3<S>(S(0.0), S(0.0), S(0.0));
    if (!at.pushes) return force;
    force = pose.turned(at.force);
    return push_vjp(own.shape, pose, x, contacts.numbers[i], at, p, numbers[i], poses[own.collider]);
  }
};

// What has gathered goes on, one block after the other; w_bar(node) takes cotangents of inverse masses.
template <class T, class W>
void spread_contacts(const ContactSource<T>& source, const DirectBlock& block, const BlockContacts<Single<T>>& contacts,
                     const BlockContactCotangents<Single<T>>& bar, const StateCotangents<T>& from_bar,
                     const Inputs<T>& in_bar, W&& w_bar) {
  if (block.contacts.empty()) return;
  auto poses_bar = no_pose_cotangents(source);
  poses_bar.next = bar.poses;
  for (std::size_t i = 0; i < block.contacts.size(); ++i) {
    const BlockContact& own = block.contacts[i];
    numbers_vjp(source, contacts.poses, own.contact, own.item, bar.numbers[i], poses_bar, from_bar, in_bar, w_bar);
    for (int k = 0; own.nodes > 1 && k < own.nodes; ++k)
      source.add(bar.weights[i][k], weight_in(in_bar, source.scene.contacts[own.contact], own.item, k));
  }
  poses_vjp(source, poses_bar, in_bar);
}

}  // namespace sheetbend
