// Where the numbers of contacts come from: the poses of colliders around a substep, and what the law reads of a point and a collider. Contacts
// of a pack's scenes are looked at one after the other.
#pragma once

#include "core/contact/impact.h"
#include "core/contact/pose.h"
#include "core/contact/rebound.h"
#include "core/contact/touch.h"
#include "core/scene/point_of.h"
#include "core/scene/scene.h"
#include "core/solver/options.h"
#include "core/solver/states.h"

namespace sheetbend {

template <class S>
struct ColliderPoses {
  std::vector<Pose<S>> next, now, before;  // per collider, at n+1, n and n-1 (empty where it is not asked for)
};

template <class T>
struct ContactSource {
  using S = Single<T>;
  const Scene& scene;
  Inputs<const T> in;
  Bdf bdf;
  double t_next, h;
  SubstepStates<T> from;
  const T* w;  // effective inverse masses, per node
  int lane;    // of a pack

  S read(const T& a) const { return in_scene(a, lane); }
  Vec3<S> read(const Vec3<T>& a) const { return {read(a.x), read(a.y), read(a.z)}; }
  Vec3<S> at(const T* state, int node) const { return read(Vec3<T>(state + scene.first_dof[node])); }

  void write(const Vec3<S>& v, T* to) const {
    set_in_scene<T>(v.x, lane, to[0]), set_in_scene<T>(v.y, lane, to[1]), set_in_scene<T>(v.z, lane, to[2]);
  }
  void add(const S& a, T& to) const { add_in_scene(a, lane, to); }
  void add(const Vec3<S>& v, T* to) const { add(v.x, to[0]), add(v.y, to[1]), add(v.z, to[2]); }

  // A point of a contact, of coordinates or of velocities; at(node) are its nodes'.
  template <class At>
  Vec3<S> point_at(const Contact& c, int item, At&& at_node) const {
    return point_of(c, item, in, at_node, [&](const T& a) { return read(a); });
  }
  Vec3<S> point(const Contact& c, int item, const T* state) const {
    return point_at(c, item, [&](int node) { return at(state, node); });
  }
  S weight(const Contact& c, int item, int k) const { return c.arity == 1 ? S(1.0) : read(weight_in(in, c, item, k)); }
  // The inverse mass of a point: sum b^2 w.
  S inverse_mass(const Contact& c, int item) const {
    const auto nodes = c.nodes_of(item);
    if (c.arity == 1) return read(w[nodes[0]]);
    S sum(0.0);
    for (int k = 0; k < c.arity; ++k) {
      const S b = weight(c, item, k);
      sum += b * b * read(w[nodes[k]]);
    }
    return sum;
  }

  // The rotation vector (slot 1) or the position (slot 0) of a collider.
  Vec3<S> pose_part(const Collider& c, double t, int slot) const {
    return read(at_knots(c.motion.at(t), in.of(Quantity::collider_pose) + c.first_pose, 2, slot));
  }

  void find_poses(ColliderPoses<S>& all) const {
    const auto find = [&](double t, std::vector<Pose<S>>& to) {
      to.resize(scene.colliders.size());
      for (std::size_t c = 0; c < to.size(); ++c) {
        to[c].position = pose_part(scene.colliders[c], t, 0);
        turn_by(pose_part(scene.colliders[c], t, 1), to[c].turn);
      }
    };
    find(t_next, all.next);
    find(t_next - h, all.now);
    all.before.clear();
    if (bdf.before != 0.0) find(t_next - 2.0 * h, all.before);
  }

  // Those of a contact's numbers that all of its points share. A rigid contact has kappa w in the place of kappa: its stiffness is rigidity m/h^2 in either
  // formula, so that what rests is as deep in both.
  ContactNumbers<S> shared_numbers(int contact) const {
    const Contact& c = scene.contacts[contact];
    const double share = bdf.eta / h;
    ContactNumbers<S> numbers{};
    numbers.friction = read(in.of(Quantity::friction)[contact]);
    numbers.radius = read(in.of(Quantity::contact_radius)[contact]);
    numbers.kappa = c.stiffness < 0 ? S(rigidity * share * share)
                                    : S(bdf.eta * bdf.eta) * read(in.of(Quantity::contact_stiffness)[c.stiffness]);
    numbers.dissipates = c.dissipation >= 0;
    if (numbers.dissipates) numbers.loss = read(in.of(Quantity::contact_dissipation)[c.dissipation]) / S(bdf.eta);
    read_size(scene.colliders[c.collider], numbers.size);
    return numbers;
  }

  // All that the law reads of a point.
  ContactNumbers<S> numbers(const ColliderPoses<S>& poses, int contact, int item) const {
    const Contact& c = scene.contacts[contact];
    ContactNumbers<S> numbers = shared_numbers(contact);
    if (c.stiffness < 0) numbers.kappa = numbers.kappa / inverse_mass(c, item);
    numbers.from = S(bdf.now) * poses.now[c.collider].in_frame(point(c, item, from.x));
    if (bdf.before != 0.0)
      numbers.from = numbers.from + S(bdf.before) * poses.before[c.collider].in_frame(point(c, item, from.x_before));
    numbers.carried = S(bdf.eta * bdf.eta) * at(from.x, c.carried[item]);
    if (c.rebounds(item)) {
      const Rebound<S> r = rebound(poses, contact, item);
      numbers.carried = S(bdf.eta * bdf.eta) * r.carried;
      numbers.lift = r.lift, numbers.leaving = r.leaving, numbers.firm = r.lifts ? firmness : 1.0;
    }
    return numbers;
  }

  // What particles bounce off at a contact with restitution.
  Surface<S> surface(const ColliderPoses<S>& poses, int contact) const {
    const Contact& c = scene.contacts[contact];
    Surface<S> s;
    s.friction = read(in.of(Quantity::friction)[contact]);
    s.restitution = read(in.of(Quantity::restitution)[c.restitution]);
    s.radius = read(in.of(Quantity::contact_radius)[contact]);
    for (S& a : s.size) a = S(0.0);
    read_size(scene.colliders[c.collider], s.size);
    s.now = poses.now[c.collider];
    s.next = poses.next[c.collider];
    return s;
  }

  // Of a point that constraints hold, at a contact with restitution. Its mass only carries a speed on; that of its first node does.
  Falling<S> falling(const ColliderPoses<S>& poses, int contact, int item) const {
    const Contact& c = scene.contacts[contact];
    return {point(c, item, from.x),
            point(c, item, from.v),
            read(Vec3<T>(in.of(Quantity::gravity))),
            at(from.x, c.carried[item]),
            read(in.of(Quantity::mass)[c.first_node(item)]),
            surface(poses, contact)};
  }
  Rebound<S> rebound(const ColliderPoses<S>& poses, int contact, int item) const {
    return sheetbend::rebound(scene.colliders[scene.contacts[contact].collider].any(), h, bdf.before == 0.0,
                              falling(poses, contact, item));
  }

  void read_size(const Collider& collider, S* size) const {
    with_shape(collider.shape, [&]<class Shape>(Shape) {
      for (int k = 0; k < size_count<Shape>; ++k)
        size[k] = read(in.of(Quantity::collider_size)[collider.first_size + k]);
    });
  }

  // The gap of a point at x from a contact's surface, with its collider at a pose.
  S gap(const Pose<S>& pose, int contact, const Vec3<S>& x) const {
    const Collider& collider = scene.colliders[scene.contacts[contact].collider];
    S size[most_sizes], at[3], n[3], distance;
    read_size(collider, size);
    pose.in_frame(x).store(at);
    distance_from(collider.any(), at, size, distance, n);
    return distance - read(in.of(Quantity::contact_radius)[contact]);
  }
  // Whether a contact does nothing to a point at x, judged by its place alone: where restitution may lift it, that does not tell.
  bool is_apart(const Pose<S>& pose, int contact, int item, const Vec3<S>& x) const {
    return !scene.contacts[contact].rebounds(item) && !(value_of(gap(pose, contact, x)) < 0.0);
  }
};

}  // namespace sheetbend
