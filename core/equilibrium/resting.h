// Contacts at rest, over any scalar. The law is that of a substep (core/contact/law.h) from coordinates that friction counts from, `held`: the points that
// touch there stick where they are, or slide at Coulomb's limit. Others have no history of friction, and slide without any. A rigid contact is as stiff
// as in a substep of 1 ms, so that a particle that rests is 1e-8 m deep. A point of a body passes its force on to the nodes that it is a sum of.
#pragma once

#include "core/solver/contact_source.h"
#include "core/step/carry_friction.h"

namespace sheetbend {

template <class T>
class RestingContacts {
 public:
  static constexpr double substep = 1e-3;  // s, in which forces are multipliers
  static constexpr double per_force = substep * substep;
  static constexpr double touching = 1e-6;  // m, of a gap that is none

  // `held`: (dofs). Reads it and the inputs later on.
  RestingContacts(const Scene& scene, const Inputs<const T>& in, double t0, const T* held)
      : w_(scene.contacts.empty() ? 0 : scene.nodes()), still_(scene.contacts.empty() ? 0 : scene.dofs(), T(0.0)) {
    if (!scene.self_contact.empty())
      throw std::invalid_argument(
          "self_contact: states of rest are not found where ropes or cloths may touch themselves. Fix: let them come "
          "to "
          "rest in a simulation, or leave it out");
    if (scene.contacts.empty()) return;
    for (int n = 0; n < scene.nodes(); ++n)
      if (scene.role[n] == Role::free && scene.inertial[n]) w_[n] = T(1.0) / in.of(Quantity::mass)[n];
    source.emplace(ContactSource<T>{
        scene, in, Bdf::first_order(substep), t0, substep, {held, held, still_.data(), still_.data()}, w_.data(), 0});
    source->find_poses(poses);
    poses.now = poses.next;
    for (int c = 0; c < static_cast<int>(scene.contacts.size()); ++c) {
      const Contact& contact = scene.contacts[c];
      for (int i = 0; i < contact.points(); ++i) {
        if (!moves(scene, contact, i)) continue;
        ContactNumbers<T> n = source->numbers(poses, c, i);
        const bool rubs =
            value_of(n.friction) > 0.0 &&
            value_of(source->gap(poses.next[contact.collider], c, source->point(contact, i, held))) <= touching;
        if (!rubs) {
          n.friction = T(0.0);
          n.carried = {T(1.0), T(1.7), T(2.9)};  // it slides, whatever the direction
        }
        items.push_back({c, i, scene.colliders[contact.collider].any(), rubs, n});
      }
    }
  }
  RestingContacts(const RestingContacts&) = delete;
  RestingContacts& operator=(const RestingContacts&) = delete;

  // A free point that may touch a collider.
  struct Item {
    int contact, item;
    AnyShape shape;
    bool rubs;  // has friction
    ContactNumbers<T> numbers;
  };
  std::vector<Item> items;
  std::optional<ContactSource<T>> source;  // none without contacts
  ColliderPoses<T> poses;

  const Contact& contact(const Item& i) const { return source->scene.contacts[i.contact]; }
  const Pose<T>& pose(const Item& i) const { return poses.next[contact(i).collider]; }
  Vec3<T> in_frame(const Item& i, const T* x) const { return pose(i).in_frame(source->point(contact(i), i.item, x)); }
  // f += a force on a point, at its nodes
  void add(const Item& i, const Vec3<T>& force, T* f) const {
    const auto nodes = contact(i).nodes_of(i.item);
    for (int k = 0; k < contact(i).arity; ++k)
      (source->weight(contact(i), i.item, k) * force).add_to(f + source->scene.first_dof[nodes[k]]);
  }

  // f += what the law has at x (dofs)  [N]
  void add_forces(const T* x, T* f) const {
    for (const Item& i : items)
      if (const Touch<T> t = touch(i.shape, in_frame(i, x), i.numbers); t.pushes)
        add(i, T(1.0 / per_force) * pose(i).turned(t.force), f);
  }

 private:
  std::vector<T> w_, still_;
};

}  // namespace sheetbend
