// The kernels over registers: the law of contact for some particles of a pack at a time, under masks.
#pragma once

#include "core/contact/balanced.h"
#include "core/contact/kernels.h"
#include "core/contact/pose.h"
#include "core/packs/lanes.h"

namespace sheetbend {

// The particles of one register: part n % parts_per_pack of pack n / parts_per_pack.
class ContactPlace {
 public:
  using Contacts = sheetbend_contacts::Contacts;
  template <class Number>
  using Points = sheetbend_contacts::Points<Number>;

  ContactPlace(const Contacts& c, long n) : first_(pack_of(n) * sheetbend_contacts::lanes + lane_of(n)), n_(n) {
    const long left = c.count - first_;
    live_ = left < register_lanes ? static_cast<int>(left) : register_lanes;
  }
  static long count(const Contacts& c) { return (static_cast<long>(c.count) + register_lanes - 1) / register_lanes; }

  long first() const { return first_; }
  int live() const { return live_; }
  // The lanes that are no repetition.
  Register::Mask alive() const {
    return per_lane<register_lanes>([](int lane) { return lane; }) < Register(live_);
  }
  Strip<double> strip(double* base, int count) const { return {base, n_, count}; }
  Strip<const double> strip(const double* base, int count) const { return {base, n_, count}; }

  template <class Number>
  Vec3<Register> load(const Points<Number>& p, const int* nodes) const {
    Vec3<Register> x;
    if (p.apart == 1 && p.stride == sheetbend_packs::row) {
      int places[register_lanes];
      for (int lane = 0; lane < register_lanes; ++lane) places[lane] = p.stride * nodes[first_ + lane];
      Register w;
      load_rows(p.data, places, x.x, x.y, x.z, w);
      return x;
    }
    for (int lane = 0; lane < register_lanes; ++lane) {
      const Number* from = p.data + static_cast<long>(p.apart) * p.stride * nodes[first_ + lane];
      x.x.set(lane, from[0]), x.y.set(lane, from[p.apart]), x.z.set(lane, from[2 * p.apart]);
    }
    return x;
  }
  void store(const Points<double>& p, const int* nodes, const Vec3<Register>& x) const {
    for (int lane = 0; lane < live_; ++lane) {
      double* to = p.data + static_cast<long>(p.apart) * p.stride * nodes[first_ + lane];
      to[0] = x.x[lane], to[p.apart] = x.y[lane], to[2 * p.apart] = x.z[lane];
    }
  }
  template <class Number>
  Register load_number(const Points<Number>& p, const int* nodes) const {
    return per_lane<register_lanes>(
        [&](int lane) { return p.data[static_cast<long>(p.apart) * p.stride * nodes[first_ + lane]]; });
  }

  void store_number(const Points<double>& p, const int* nodes, const Register& a) const {
    for (int lane = 0; lane < live_; ++lane)
      p.data[static_cast<long>(p.apart) * p.stride * nodes[first_ + lane]] = a[lane];
  }
  // These lanes of sums (numbers, 8), to which all places add.
  Strip<double> lanes_of(double* numbers) const { return {numbers, n_ % parts_per_pack, 0}; }

 private:
  long first_, n_;
  int live_;
};

template <class P>
Vec3<Register> vector_of(const Strip<P>& s, int i) {
  return {s[i], s[i + 1], s[i + 2]};
}
template <class P>
void set_vector(const Strip<P>& s, int i, const Vec3<Register>& v) {
  s.set(i, v.x), s.set(i + 1, v.y), s.set(i + 2, v.z);
}

inline Pose<Register> pose_of(const double* numbers) {
  Pose<Register> p;
  p.position = {numbers[0], numbers[1], numbers[2]};
  for (int k = 0; k < 9; ++k) p.turn[k] = numbers[3 + k];
  return p;
}

template <class S>
class ContactKernels {
 public:
  using Contacts = sheetbend_contacts::Contacts;
  using Given = sheetbend_contacts::Given;
  using Numbers = ContactNumbers<Register>;
  using Mask = Register::Mask;
  static constexpr OneShape<S> shape{};

  explicit ContactKernels(const Contacts& contacts) : c(contacts), next(pose_of(contacts.next)) {
    for (int k = 0; k < sheetbend::most_sizes; ++k) size_[k] = k < size_count<S> ? c.size[k] : 0.0;
  }

  static int project(const Contacts& contacts, const sheetbend_contacts::Pass& pass) {
    const ContactKernels k(contacts);
    for (long n = 0; n < ContactPlace::count(contacts); ++n)
      if (const int lost = k.project_place(ContactPlace(contacts, n), pass); lost >= 0) return lost;
    return -1;
  }

  static void carry(const Contacts& contacts, const sheetbend_contacts::Carry& carry) {
    const ContactKernels k(contacts);
    for (long n = 0; n < ContactPlace::count(contacts); ++n) k.carry_place(ContactPlace(contacts, n), carry);
  }

  static bool begins(const Contacts& contacts, const Given& x) {
    const ContactKernels k(contacts);
    const Pose<Register> now = pose_of(contacts.pose_now);
    for (long n = 0; n < ContactPlace::count(contacts); ++n) {
      const ContactPlace place(contacts, n);
      const Mask inside = k.is_inside(k.next.in_frame(place.load(x, contacts.nodes)));
      if (any(inside) && any(inside & !k.is_inside(now.in_frame(place.load(contacts.x, contacts.nodes))))) return true;
    }
    return false;
  }

 protected:
  Mask is_inside(const Vec3<Register>& z) const {
    Register at[3], distance, n[3];
    z.store(at);
    distance_from(shape, at, size_, distance, n);
    return distance - Register(c.radius) < Register(0.0);
  }

  // What the law reads, which the first to come near finds.
  Numbers numbers(const ContactPlace& place, Register& w) const {
    const auto own = place.strip(c.numbers, sheetbend_contacts::point_numbers);
    if (!c.ready[place.first()]) {
      c.ready[place.first()] = true;
      Vec3<Register> from = Register(c.now) * pose_of(c.pose_now).in_frame(place.load(c.x, c.nodes));
      if (c.before != 0.0)
        from = from + Register(c.before) * pose_of(c.pose_before).in_frame(place.load(c.x_before, c.nodes));
      const Register inverse_mass = place.load_number(c.w, c.nodes);
      set_vector(own, 0, from);
      set_vector(own, 3, Register(c.eta2) * place.load(c.x, c.carries));
      own.set(6, c.soft ? Register(c.kappa) : Register(c.kappa) / inverse_mass);
      own.set(7, inverse_mass);
    }
    Numbers a{};
    a.from = vector_of(own, 0), a.carried = vector_of(own, 3), a.kappa = own[6], w = own[7];
    a.friction = c.friction, a.radius = c.radius, a.loss = c.loss, a.dissipates = c.dissipates;
    for (int k = 0; k < sheetbend::most_sizes; ++k) a.size[k] = size_[k];
    return a;
  }

  const Contacts& c;
  const Pose<Register> next;

 private:
  int project_place(const ContactPlace& place, const sheetbend_contacts::Pass& pass) const {
    const long first = place.first();
    const bool pushed = pass.push_before && pass.pushes_before[first];
    Vec3<Register> y = place.load(pass.q, c.nodes);
    if (pushed) {
      const Register w = place.strip(c.numbers, sheetbend_contacts::point_numbers)[7];
      y = y - w * vector_of(place.strip(pass.push_before, sheetbend_contacts::push_numbers), 3);
    }
    const Vec3<Register> own = next.in_frame(y);
    pass.pushes[first] = false;
    if (!any(is_inside(own))) {
      if (pushed) place.store(pass.q, c.nodes, y);
      return -1;
    }
    Register w;
    const Numbers numbers = this->numbers(place, w);
    const auto b = balanced(shape, own, w, numbers);
    if (const Mask lost = !b.found; any(lost))
      for (int lane = 0; lane < place.live(); ++lane)
        if (has(lost, lane)) return static_cast<int>(first) + lane;
    const Vec3<Register> moved = next.turned(b.z - own), none(0.0, 0.0, 0.0);
    const Vec3<Register> x = select(b.pushes, y + moved, y);
    const auto push = place.strip(pass.push, sheetbend_contacts::push_numbers);
    set_vector(push, 0, x);
    set_vector(push, 3, select(b.pushes, (Register(1.0) / w) * moved, none));
    push.set(6, select(b.pushes, Register(1.0), Register(0.0)));
    pass.pushes[first] = any(b.pushes);
    place.store(pass.q, c.nodes, x);
    return -1;
  }

  void carry_place(const ContactPlace& place, const sheetbend_contacts::Carry& carry) const {
    Vec3<Register> force(0.0, 0.0, 0.0);
    const Vec3<Register> z = next.in_frame(place.load(carry.x, c.nodes));
    for (int lane = 0; lane < place.live(); ++lane) carry.modes[place.first() + lane] = 0;
    if (any(is_inside(z))) {
      Register w;
      const auto t = touch(shape, z, numbers(place, w));
      force = Register(carry.rate) * t.tangential;
      for (int lane = 0; lane < place.live(); ++lane)
        carry.modes[place.first() + lane] = static_cast<char>(!has(t.pushes, lane) ? 0 : has(t.slides, lane) ? 2 : 1);
    }
    place.store(carry.carried, c.carries, force);
  }

  Register size_[sheetbend::most_sizes];
};

}  // namespace sheetbend
