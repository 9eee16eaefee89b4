// The reverse of ContactSource: cotangents of what a contact reads go to the states at n and n-1, to the inputs and to the inverse mass.
#pragma once

#include "adjoint/contact/collision_vjp.h"
#include "adjoint/contact/impact_vjp.h"
#include "adjoint/contact/rebound_vjp.h"
#include "adjoint/contact/touch_vjp.h"
#include "adjoint/solver/cotangents.h"
#include "core/solver/contact_source.h"

namespace sheetbend {

// Cotangents of the poses of all colliders, zero.
template <class T>
ColliderPoses<Single<T>> no_pose_cotangents(const ContactSource<T>& source) {
  const std::vector<Pose<Single<T>>> none(source.scene.colliders.size(), Pose<Single<T>>{});
  return {none, none, source.bdf.before == 0.0 ? std::vector<Pose<Single<T>>>{} : none};
}

// Of the weights alone, of a sum of at(node) over the nodes of a point.
template <class T, class At>
void weights_vjp(const ContactSource<T>& source, const Contact& c, int item, const Vec3<Single<T>>& bar, At&& at,
                 const Inputs<T>& in_bar) {
  if (c.arity == 1) return;
  for (int k = 0; k < c.arity; ++k) source.add(dot(at(c.nodes_of(item)[k]), bar), weight_in(in_bar, c, item, k));
}

// Reverse of ContactSource::point_at: cotangents of a point go to its nodes, by to(node), and to its weights. at(node) are its nodes'.
template <class T, class At, class To>
void point_vjp(const ContactSource<T>& source, const Contact& c, int item, const Vec3<Single<T>>& bar, At&& at, To&& to,
               const Inputs<T>& in_bar) {
  const auto nodes = c.nodes_of(item);
  if (c.arity == 1) return source.add(bar, to(nodes[0]));
  for (int k = 0; k < c.arity; ++k) source.add(source.weight(c, item, k) * bar, to(nodes[k]));
  weights_vjp(source, c, item, bar, at, in_bar);
}
// Of ContactSource::point.
template <class T>
void point_vjp(const ContactSource<T>& source, const Contact& c, int item, const Vec3<Single<T>>& bar, const T* state,
               T* state_bar, const Inputs<T>& in_bar) {
  point_vjp(
      source, c, item, bar, [&](int node) { return source.at(state, node); },
      [&](int node) { return state_bar + source.scene.first_dof[node]; }, in_bar);
}

// Reverse of ContactSource::inverse_mass; w_bar(node) takes cotangents of inverse masses.
template <class T, class W>
void inverse_mass_vjp(const ContactSource<T>& source, const Contact& c, int item, const Single<T>& bar, W&& w_bar,
                      const Inputs<T>& in_bar) {
  using S = Single<T>;
  const auto nodes = c.nodes_of(item);
  if (c.arity == 1) return source.add(bar, w_bar(nodes[0]));
  for (int k = 0; k < c.arity; ++k) {
    const S b = source.weight(c, item, k);
    source.add(b * b * bar, w_bar(nodes[k]));
    source.add(S(2.0) * b * source.read(source.w[nodes[k]]) * bar, weight_in(in_bar, c, item, k));
  }
}

// Cotangents of a collider's lengths.
template <class T>
void size_vjp(const ContactSource<T>& source, const Collider& collider, const Single<T>* bar, const Inputs<T>& in_bar) {
  with_shape(collider.shape, [&]<class Shape>(Shape) {
    for (int k = 0; k < size_count<Shape>; ++k)
      source.add(bar[k], in_bar.of(Quantity::collider_size)[collider.first_size + k]);
  });
}

// Reverse of ContactSource::surface.
template <class T>
void surface_vjp(const ContactSource<T>& source, int contact, const Surface<Single<T>>& bar,
                 ColliderPoses<Single<T>>& poses_bar, const Inputs<T>& in_bar) {
  using S = Single<T>;
  const Contact& c = source.scene.contacts[contact];
  source.add(bar.friction, in_bar.of(Quantity::friction)[contact]);
  source.add(bar.restitution, in_bar.of(Quantity::restitution)[c.restitution]);
  source.add(bar.radius, in_bar.of(Quantity::contact_radius)[contact]);
  size_vjp(source, source.scene.colliders[c.collider], bar.size, in_bar);
  const auto add = [](const Pose<S>& from, Pose<S>& to) {
    to.position = to.position + from.position;
    for (int k = 0; k < 9; ++k) to.turn[k] += from.turn[k];
  };
  add(bar.now, poses_bar.now[c.collider]);
  add(bar.next, poses_bar.next[c.collider]);
}

// Reverse of ContactSource::rebound.
template <class T>
void rebound_vjp(const ContactSource<T>& source, const ColliderPoses<Single<T>>& poses, int contact, int item,
                 const Rebound<Single<T>>& bar, ColliderPoses<Single<T>>& poses_bar, const StateCotangents<T>& from_bar,
                 const Inputs<T>& in_bar) {
  const Scene& scene = source.scene;
  const Contact& c = scene.contacts[contact];
  const auto f = rebound_vjp(scene.colliders[c.collider].any(), source.h, source.bdf.before == 0.0,
                             source.falling(poses, contact, item), bar);
  point_vjp(source, c, item, f.x, source.from.x, from_bar.x, in_bar);
  point_vjp(source, c, item, f.v, source.from.v, from_bar.v, in_bar);
  source.add(f.gravity, in_bar.of(Quantity::gravity));
  source.add(f.carried, from_bar.x + scene.first_dof[c.carried[item]]);
  source.add(f.mass, in_bar.of(Quantity::mass)[c.first_node(item)]);
  surface_vjp(source, contact, f.surface, poses_bar, in_bar);
}

// Reverse of ContactSource::shared_numbers, but for the mass in the stiffness of a rigid contact.
template <class T>
void shared_numbers_vjp(const ContactSource<T>& source, int contact, const ContactNumbers<Single<T>>& bar,
                        const Inputs<T>& in_bar) {
  using S = Single<T>;
  const Contact& c = source.scene.contacts[contact];
  source.add(bar.friction, in_bar.of(Quantity::friction)[contact]);
  source.add(bar.radius, in_bar.of(Quantity::contact_radius)[contact]);
  size_vjp(source, source.scene.colliders[c.collider], bar.size, in_bar);
  if (c.dissipation >= 0)
    source.add(bar.loss / S(source.bdf.eta), in_bar.of(Quantity::contact_dissipation)[c.dissipation]);
  if (c.stiffness >= 0)
    source.add(S(source.bdf.eta * source.bdf.eta) * bar.kappa, in_bar.of(Quantity::contact_stiffness)[c.stiffness]);
}

// Reverse of ContactSource::numbers; w_bar(node) takes cotangents of inverse masses.
template <class T, class W>
void numbers_vjp(const ContactSource<T>& source, const ColliderPoses<Single<T>>& poses, int contact, int item,
                 const ContactNumbers<Single<T>>& bar, ColliderPoses<Single<T>>& poses_bar,
                 const StateCotangents<T>& from_bar, const Inputs<T>& in_bar, W&& w_bar) {
  using S = Single<T>;
  const Scene& scene = source.scene;
  const Contact& c = scene.contacts[contact];
  const auto history = [&](double weight, const std::vector<Pose<S>>& pose, std::vector<Pose<S>>& pose_bar, const T* x,
                           T* x_bar) {
    const Vec3<S> point_bar =
        in_frame_vjp(pose[c.collider], source.point(c, item, x), S(weight) * bar.from, pose_bar[c.collider]);
    point_vjp(source, c, item, point_bar, x, x_bar, in_bar);
  };
  history(source.bdf.now, poses.now, poses_bar.now, source.from.x, from_bar.x);
  if (source.bdf.before != 0.0)
    history(source.bdf.before, poses.before, poses_bar.before, source.from.x_before, from_bar.x_before);
  const S eta2(source.bdf.eta * source.bdf.eta);
  if (c.rebounds(item))
    rebound_vjp(source, poses, contact, item, {eta2 * bar.carried, bar.lift, bar.leaving}, poses_bar, from_bar, in_bar);
  else
    source.add(eta2 * bar.carried, from_bar.x + scene.first_dof[c.carried[item]]);
  shared_numbers_vjp(source, contact, bar, in_bar);
  if (c.stiffness >= 0) return;
  const S w = source.inverse_mass(c, item);
  const double share = source.bdf.eta / source.h;
  inverse_mass_vjp(source, c, item, -(S(rigidity * share * share) * bar.kappa / (w * w)), w_bar, in_bar);
}

// Reverse of ContactSource::find_poses.
template <class T>
void poses_vjp(const ContactSource<T>& source, const ColliderPoses<Single<T>>& bar, const Inputs<T>& in_bar) {
  using S = Single<T>;
  const auto back = [&](double t, const std::vector<Pose<S>>& own) {
    for (std::size_t c = 0; c < own.size(); ++c) {
      const Collider& collider = source.scene.colliders[c];
      const KnotWeights k = collider.motion.at(t);
      const Vec3<S> rotation_bar = turn_by_vjp(source.pose_part(collider, t, 1), own[c].turn);
      for (int i = 0; i < k.count; ++i) {
        T* knot = in_bar.of(Quantity::collider_pose) + collider.first_pose + 6 * static_cast<std::size_t>(k.first + i);
        source.add(S(k.weight[i]) * own[c].position, knot);
        source.add(S(k.weight[i]) * rotation_bar, knot + 3);
      }
    }
  };
  back(source.t_next, bar.next);
  back(source.t_next - source.h, bar.now);
  if (!bar.before.empty()) back(source.t_next - 2.0 * source.h, bar.before);
}

}  // namespace sheetbend
