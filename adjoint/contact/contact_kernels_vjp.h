// The reverses of the kernels of contacts (core/packs/contact_kernels.h).
#pragma once

#include "adjoint/contact/push_out_vjp.h"
#include "core/packs/contact_kernels.h"

namespace sheetbend {

// Adds a pose's cotangents, lane by lane.
inline void add_pose(const Pose<Register>& bar, const Strip<double>& to) {
  to.add(0, bar.position.x), to.add(1, bar.position.y), to.add(2, bar.position.z);
  for (int k = 0; k < 9; ++k) to.add(3 + k, bar.turn[k]);
}

template <class S>
class ContactKernelsVjp : ContactKernels<S> {
  using Base = ContactKernels<S>;
  using Base::c, Base::next, Base::shape;
  using typename Base::Mask, typename Base::Numbers;

 public:
  using typename Base::Contacts;
  using Written = sheetbend_contacts::Written;
  using Pass = sheetbend_contacts::Pass;
  using Carry = sheetbend_contacts::Carry;
  using Cotangents = sheetbend_contacts::Cotangents;

  ContactKernelsVjp(const Contacts& contacts, const Cotangents& cotangents) : Base(contacts), bar(cotangents) {}

  static void project_vjp(const Contacts& contacts, const Pass& pass, const Cotangents& bar) {
    ContactKernelsVjp k(contacts, bar);
    for (long n = 0; n < ContactPlace::count(contacts); ++n) k.project_place_vjp(ContactPlace(contacts, n), pass);
  }
  static void carry_vjp(const Contacts& contacts, const Carry& carry, const Written& x_bar, const Cotangents& bar) {
    ContactKernelsVjp k(contacts, bar);
    for (long n = 0; n < ContactPlace::count(contacts); ++n) k.carry_place_vjp(ContactPlace(contacts, n), carry, x_bar);
  }

 private:
  void project_place_vjp(const ContactPlace& place, const Pass& pass) const {
    const long first = place.first();
    const bool pushes = pass.pushes[first], pushed = pass.push_before && pass.pushes_before[first];
    if (!pushes && !pushed) return;
    const Vec3<Register> x_bar = place.load(pass.q, c.nodes), none(0.0, 0.0, 0.0);
    const auto force_bar = place.strip(bar.force, 3);
    Register w, w_bar(0.0);
    const Numbers numbers = this->numbers(place, w);
    Vec3<Register> y_bar = x_bar;
    if (pushes) {
      const auto push = place.strip(pass.push, sheetbend_contacts::push_numbers);
      const Mask own = (push[6] > Register(0.0)) & place.alive();
      const Vec3<Register> x = vector_of(push, 0);
      Numbers numbers_bar{};
      Pose<Register> pose_bar{};
      const Vec3<Register> b = select(own, vector_of(force_bar, 0) + w * x_bar, none);
      y_bar = x_bar + push_out_vjp(shape, next, x, w, numbers, b, numbers_bar, pose_bar);
      w_bar += dot(vector_of(push, 3), y_bar);
      add(place, numbers_bar, pose_bar);
    }
    set_vector(force_bar, 0, none);
    if (pushed) {
      w_bar -= dot(vector_of(place.strip(pass.push_before, sheetbend_contacts::push_numbers), 3), y_bar);
      set_vector(force_bar, 0, -(w * y_bar));
    }
    place.strip(bar.numbers, sheetbend_contacts::point_numbers).add(7, w_bar);
    place.store(pass.q, c.nodes, y_bar);
  }

  void carry_place_vjp(const ContactPlace& place, const Carry& carry, const Written& to) const {
    const Vec3<Register> x = place.load(carry.x, c.nodes), z = next.in_frame(x), none(0.0, 0.0, 0.0);
    if (!any(this->is_inside(z))) return;
    Register w;
    const Numbers numbers = this->numbers(place, w);
    Numbers numbers_bar{};
    Pose<Register> pose_bar{};
    const Vec3<Register> tangential_bar = Register(carry.rate) * place.load(carry.carried, c.carries);
    const Vec3<Register> z_bar =
        touch_vjp(shape, z, numbers, none, select(place.alive(), tangential_bar, none), numbers_bar);
    const Vec3<Register> x_bar = in_frame_vjp(next, x, z_bar, pose_bar);
    place.store(to, c.nodes, place.load(to, c.nodes) + x_bar);
    add(place, numbers_bar, pose_bar);
  }

  void add(const ContactPlace& place, const Numbers& a, const Pose<Register>& pose) const {
    const auto own = place.strip(bar.numbers, sheetbend_contacts::point_numbers);
    own.add(0, a.from.x), own.add(1, a.from.y), own.add(2, a.from.z);
    own.add(3, a.carried.x), own.add(4, a.carried.y), own.add(5, a.carried.z);
    own.add(6, a.kappa);
    const auto shared = place.lanes_of(bar.shared);
    shared.add(0, a.friction), shared.add(1, a.radius);
    if (c.dissipates) shared.add(2, a.loss);
    for (int k = 0; k < size_count<S>; ++k) shared.add(4 + k, a.size[k]);
    add_pose(pose, place.lanes_of(bar.next));
  }

  const Cotangents& bar;
};

inline void contact_numbers_vjp(const sheetbend_contacts::Contacts& c, const sheetbend_contacts::Cotangents& bar,
                                const sheetbend_contacts::Written& x_bar,
                                const sheetbend_contacts::Written& x_before_bar,
                                const sheetbend_contacts::Written& w_bar) {
  const Pose<Register> now = pose_of(c.pose_now), before = pose_of(c.pose_before);
  for (long n = 0; n < ContactPlace::count(c); ++n) {
    const ContactPlace place(c, n);
    if (!c.ready[place.first()]) continue;
    const auto own = place.strip(bar.numbers, sheetbend_contacts::point_numbers);
    const Vec3<Register> from_bar = vector_of(own, 0);
    const auto history = [&](double weight, const Pose<Register>& pose, double* pose_bar,
                             const sheetbend_contacts::Given& x, const sheetbend_contacts::Written& to) {
      Pose<Register> turned{};
      const Vec3<Register> point_bar = in_frame_vjp(pose, place.load(x, c.nodes), Register(weight) * from_bar, turned);
      add_pose(turned, place.lanes_of(pose_bar));
      place.store(to, c.nodes, place.load(to, c.nodes) + point_bar);
    };
    history(c.now, now, bar.pose_now, c.x, x_bar);
    if (c.before != 0.0) history(c.before, before, bar.pose_before, c.x_before, x_before_bar);
    place.store(x_bar, c.carries, place.load(x_bar, c.carries) + Register(c.eta2) * vector_of(own, 3));
    const Register w = place.strip(c.numbers, sheetbend_contacts::point_numbers)[7];
    if (c.soft) place.lanes_of(bar.shared).add(3, own[6]);
    const Register own_w_bar = c.soft ? own[7] : own[7] - Register(c.kappa) * own[6] / (w * w);
    place.store_number(w_bar, c.nodes, place.load_number(w_bar, c.nodes) + own_w_bar);
  }
}

}  // namespace sheetbend
