// The impact of a particle that bounces: when in a substep it meets a surface, and how it flies on. Per mass and in the world's frame,
//
//   push      (1 + e) |n . w|          w: its velocity at the impact less the surface's,  e: restitution
//   friction  min(mu push, |slip|)     against the slip, the part of w along the surface
//
// The velocity is that at the impact: the one at the end of the substep gives gradients of the wrong sign. BDF1's path is straight; BDF2's is the parabola
// from the velocity at the start to the end, since BDF1's end would give it twice the acceleration.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/contact/pose.h"
#include "core/contact/shapes.h"

namespace sheetbend {

// An approach bounces where it would leave faster than this many times what the acceleration adds in a substep; a slower one comes to rest.
inline constexpr double slowest_bounce = 2.0;

// What is left of a substep for a particle with nothing in its way.
template <class S>
struct Flight {
  static constexpr int numbers = 13;
  Vec3<S> x, v, x_end, v_end;
  S left{};  // time

  template <class Self, class F>
  static void each(Self& f, F&& visit) {
    for (auto* w : {&f.x, &f.v, &f.x_end, &f.v_end}) visit(w->x), visit(w->y), visit(w->z);
    visit(f.left);
  }
};

// A collider around a substep, and the law at its surface.
template <class S>
struct Surface {
  static constexpr int numbers = 3 + most_sizes + 24;
  S friction{}, restitution{}, radius{};
  S size[most_sizes];
  Pose<S> now, next;

  template <class Self, class F>
  static void each(Self& s, F&& visit) {
    visit(s.friction), visit(s.restitution), visit(s.radius);
    for (auto& a : s.size) visit(a);
    for (auto* pose : {&s.now, &s.next}) {
      visit(pose->position.x), visit(pose->position.y), visit(pose->position.z);
      for (auto& a : pose->turn) visit(a);
    }
  }
};

// The values of a Flight or a Surface.
template <template <class> class Numbers, class S>
Numbers<double> as_values(const Numbers<S>& from) {
  double all[Numbers<S>::numbers];
  int i = 0;
  Numbers<S>::each(from, [&](const S& a) { all[i++] = value_of(a); });
  Numbers<double> to;
  i = 0;
  Numbers<double>::each(to, [&](double& a) { a = all[i++]; });
  return to;
}

// How a substep of h meets flights: of which shape the surface is, and whether paths are parabolas.
struct ImpactRule {
  AnyShape shape;
  double h;
  bool curved;
};

// Where a flight is after the time t.
template <class S>
struct Moment {
  Vec3<S> at, velocity;
  Moment(bool curved, const Flight<S>& f, const S& t) {
    const S share = t / f.left;
    velocity = f.v + share * (f.v_end - f.v);
    at = f.x + share * (f.x_end - f.x);
    if (curved) at = at + (S(0.5) * share * (t - f.left)) * (f.v_end - f.v);
  }
};

// And where it is relative to a surface. Points of the collider's frame go straight from one pose to the other.
template <class S>
struct Approach : Moment<S> {
  using Moment<S>::at, Moment<S>::velocity;
  S gap, rate;  // and its derivative
  Vec3<S> normal, surface_velocity;
  Approach(const ImpactRule& rule, const Flight<S>& f, const Surface<S>& s, const S& t) : Moment<S>(rule.curved, f, t) {
    const S passed = S(1.0) - (f.left - t) / S(rule.h);
    const Vec3<S> direction = rule.curved ? velocity : (S(1.0) / f.left) * (f.x_end - f.x);
    const auto between = [&](const Vec3<S>& a, const Vec3<S>& b) { return a + passed * (b - a); };
    const Vec3<S> z_now = s.now.in_frame(at), z_next = s.next.in_frame(at), z = between(z_now, z_next);
    S place[3], n[3];
    z.store(place);
    distance_from(rule.shape, place, s.size, gap, n);
    gap = gap - s.radius;
    const auto turned = [&](const Vec3<S>& own) { return between(s.now.turned(own), s.next.turned(own)); };
    normal = turned(unit_normal(rule.shape, Vec3<S>(n)));
    surface_velocity = S(1.0 / rule.h) * ((s.next.position + s.next.turned(z)) - (s.now.position + s.now.turned(z)));
    // Not -n . surface_velocity where it turns: that is the same to first order alone, and the time of the impact needs the derivative.
    rate = dot(Vec3<S>(n), S(1.0 / rule.h) * (z_next - z_now) +
                               between(s.now.turned_back(direction), s.next.turned_back(direction)));
  }
};

// Whether a flight begins outside a surface and ends inside.
inline bool meets(const ImpactRule& rule, const Flight<double>& f, const Surface<double>& s) {
  return f.left > 0.0 && Approach<double>(rule, f, s, f.left).gap < 0.0 &&
         !(Approach<double>(rule, f, s, 0.0).gap < 0.0);
}

// When it gets there, from outside at `before` to inside at `after`, by bisection with steps of Newton's method.
inline double time_of_impact(const ImpactRule& rule, const Flight<double>& f, const Surface<double>& s, double before,
                             double after) {
  double t = 0.5 * (before + after);
  for (int turn = 0; turn < 100 && after - before > 1e-15 * f.left; ++turn) {
    const Approach<double> a(rule, f, s, t);
    (a.gap < 0.0 ? after : before) = t;
    const double newton = t - a.gap / a.rate;
    if (newton == t) break;
    t = newton > before && newton < after ? newton : 0.5 * (before + after);
  }
  return t;
}

// Whether it leaves again what it meets at t.
inline bool bounces(const ImpactRule& rule, const Flight<double>& f, const Surface<double>& s, double t) {
  const Approach<double> a(rule, f, s, t);
  const double speed = -dot(a.normal, a.velocity - a.surface_velocity);
  const double pressed = std::max(0.0, -dot(a.normal, f.v_end - f.v) / f.left);
  return a.rate < 0.0 && speed > 0.0 && s.restitution * speed > slowest_bounce * rule.h * pressed;
}

// A flight that a kick changes after the time t.
template <class S>
Flight<S> kicked(const Moment<S>& m, const Flight<S>& f, const S& t, const Vec3<S>& kick) {
  const S left = f.left - t;
  return {m.at, m.velocity + kick, f.x_end + left * kick, f.v_end + kick, left};
}

// What an impact adds to the velocity. Without friction what slips stays as it is, however little.
template <class S>
Vec3<S> kick_of(const Approach<S>& a, const Surface<S>& s) {
  const Vec3<S> w = a.velocity - a.surface_velocity;
  const S speed = -dot(a.normal, w);
  const Vec3<S> slip = w + speed * a.normal;
  const S push = (S(1.0) + s.restitution) * speed, limit = s.friction * push, squared = dot(slip, slip);
  if (value_of(limit) == 0.0 && value_of(squared) == 0.0) return push * a.normal;
  const bool slides = value_of(squared) > value_of(limit) * value_of(limit);
  return push * a.normal - (slides ? (limit / sqrt(squared)) * slip : slip);
}

// The flight after the impact near the time `guess`, which one step of Newton's method makes that of a scalar with tangents.
template <class S>
Flight<S> bounced(const ImpactRule& rule, const Flight<S>& f, const Surface<S>& s, double guess) {
  const Approach<S> near(rule, f, s, S(guess));
  const S t = S(guess) - near.gap / near.rate;
  const Approach<S> a(rule, f, s, t);
  return kicked(a, f, t, kick_of(a, s));
}

}  // namespace sheetbend
