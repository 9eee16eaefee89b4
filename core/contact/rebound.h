// Restitution of a particle that constraints hold, inside the balance of its block. At the share s of a substep of BDF1 it meets the surface with the
// speed v. In this substep and the next one the contact pushes until the particle is as far above the surface as it would be had it bounced alone (impact.h):
//
//   first   lift = (1 - s) h u           u = (1 + e) v - v_end     v_end: speed of approach at the end, had nothing been in the way
//   second  lift = gap + h (u - h a)     a: acceleration towards the surface, of gravity alone; gap: at the end of the first
//
// That is the law of law.h with gap - lift in the place of the gap. The pushes go through the whole block, friction has all of them, and what would leave
// faster is not held back. The speed is that at the impact, as gradients need it. `leaving` = m u/h is carried to the second substep beside the
// tangential force, along the normal [N].
//
// The approach is that of the particle with its velocity and gravity alone, since what constraints add is not known before the balance. Where they carry it
// in although it would have stayed outside, it is stopped there and bounces in the next substep.
#pragma once

#include "core/contact/impact.h"
#include "core/contact/law.h"

namespace sheetbend {

// A contact that lifts is so many times stiffer than a rigid one. It gives way by its push over its stiffness. A share of that, which depends on s, is lost
// in velocity, and the gradient with respect to the time of the impact has 1/h of it: with 100 that of a ball in docs/contact_law.md is 2 % off at 1 ms.
inline constexpr double firmness = 1e3;

inline constexpr double no_return = 1e-9;  // of a carried force, that rounding may leave along the normal

// What it reads: a particle at n, with its velocity, and the force carried to it in the collider's frame.
template <class S>
struct Falling {
  static constexpr int numbers = 13 + Surface<S>::numbers;
  Vec3<S> x, v, gravity, carried;
  S mass{};
  Surface<S> surface;

  template <class Self, class F>
  static void each(Self& r, F&& visit) {
    for (auto* w : {&r.x, &r.v, &r.gravity, &r.carried}) visit(w->x), visit(w->y), visit(w->z);
    visit(r.mass);
    Surface<S>::each(r.surface, visit);
  }
};

template <class S>
struct Rebound {
  static constexpr int numbers = 5;
  Vec3<S> carried;  // the tangential part alone
  S lift{}, leaving{};
  bool lifts = false;

  template <class Self, class F>
  static void each(Self& r, F&& visit) {
    visit(r.carried.x), visit(r.carried.y), visit(r.carried.z), visit(r.lift), visit(r.leaving);
  }
};

// In a substep of h with a shape. An approach that would leave slower than what presses the particle on makes in two substeps rests. BDF2 has no
// impacts (first_order.h): `impacts` says whether the formula is BDF1.
template <class S>
Rebound<S> rebound(const AnyShape& shape, double h, bool impacts, const Falling<S>& f) {
  const auto gap_at = [&](const Pose<S>& pose, const Vec3<S>& x, S* n) {
    S at[3], distance;
    pose.in_frame(x).store(at);
    distance_from(shape, at, f.surface.size, distance, n);
    return distance - f.surface.radius;
  };
  S n[3], n_end[3];
  const S gap = gap_at(f.surface.now, f.x, n);
  const Vec3<S> normal = unit_normal(shape, Vec3<S>(n));
  const S returning = dot(normal, f.carried);
  Rebound<S> r{f.carried - returning * normal, S(0.0), S(0.0), false};
  if (!impacts) return r;
  const S fall = S(h * h) * -dot(f.surface.now.turned(normal), f.gravity);  // h^2 a
  if (value_of(returning) > no_return * std::sqrt(value_of(dot(f.carried, f.carried)))) {
    r.lift = gap + S(h * h) * returning / f.mass - fall;
    r.lifts = true;
    return r;
  }
  const S below = gap_at(f.surface.next, f.x + S(h) * (f.v + S(h) * f.gravity), n_end);
  if (!(value_of(below) < 0.0)) return r;
  const bool touches = value_of(gap) < 0.0;
  const S approach = gap - below;                                      // h v_end
  const S left = touches ? S(1.0) : -(below / approach);               // 1 - s
  const S met = approach - left * fall;                                // h v
  const S leaves = (S(1.0) + f.surface.restitution) * met - approach;  // h u
  const double pressed = std::max(value_of(fall), touches ? -rigidity * value_of(gap) : 0.0);
  const double back = value_of(f.surface.restitution) * value_of(met);
  if (!(back > 0.0) || !(back > slowest_bounce * pressed)) return r;
  r.lift = left * leaves;
  r.leaving = f.mass * leaves / S(h * h);
  r.lifts = true;
  return r;
}

}  // namespace sheetbend
