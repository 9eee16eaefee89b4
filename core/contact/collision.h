// Two balls that hit each other: when in a substep they meet, and how they fly on. Seen from the other one, a ball is a flight that bounces off a sphere as
// wide as both (core/contact/impact.h), without friction; each takes the part of the kick that leaves their momentum as it was.
//
//   push = (1 + e) |n . w|        w: velocity of one less that of the other at the impact, n along their centers, e: restitution
//   v1  += m2/(m1 + m2) push n,   v2 -= m1/(m1 + m2) push n
//
// Where constraints join them to more, the push moves that too, and has to be larger for the approach to end in (1 + e) of it:
//
//   push = (1 + e) |n . w| (1/m1 + 1/m2)/(1/m1 + 1/m2 - n . D n)       D: core/solver/joined_balls.h
//
// where the constraints leave enough of the inverse mass to push: more than a fifth of it if they link the two, and anything beyond rounding otherwise
// (joined_push). Elsewhere the push is that of the masses alone.
#pragma once

#include <array>
#include <optional>

#include "core/contact/impact.h"

namespace sheetbend {

template <class S>
struct Ball {
  Flight<S> flight;
  S radius{}, mass{};
};

template <class S>
struct BallPair {
  static constexpr int alone = 2 * (Flight<S>::numbers + 2) + 1, numbers = alone + 9;
  Ball<S> one, other;
  S restitution{};
  bool joined = false;  // whether D is asked for
  bool linked = false;  // by the same constraints
  std::array<Vec3<S>, 3> D{};

  int count() const { return joined ? numbers : alone; }

  template <class Self, class F>
  static void each(Self& p, F&& visit) {
    for (auto* ball : {&p.one, &p.other}) {
      Flight<S>::each(ball->flight, visit);
      visit(ball->radius), visit(ball->mass);
    }
    visit(p.restitution);
    if (p.joined)
      for (auto& column : p.D) visit(column.x), visit(column.y), visit(column.z);
  }
};

// Balls that overlap and approach should have met before: at the time, some substeps ago at most, to which their paths lead back. This moves them apart.
inline constexpr double longest_overdue = 32.0;  // substeps

// When two balls meet, since the later of their flights began. Not `dated`: at once, whatever moves them, for their paths lead back to no such time.
struct BallMeeting {
  double time;
  bool dated;
  bool rests;  // too slow to bounce: they go on together
};

// From the start of the later flight on. Flights that began at the same instant are cut too: the derivatives of their starts may differ.
template <class S>
struct Together {
  Flight<S> one, other, apart;  // and the first one relative to the second
  Together(bool curved, const BallPair<S>& p) : one(p.one.flight), other(p.other.flight) {
    const auto cut = [&](Flight<S>& f, const S& left) {
      if (value_of(f.left) < value_of(left)) return;
      const Moment<S> m(curved, f, f.left - left);
      f = {m.at, m.velocity, f.x_end, f.v_end, left};
    };
    cut(one, other.left), cut(other, one.left);
    apart = {one.x - other.x, one.v - other.v, one.x_end - other.x_end, one.v_end - other.v_end, one.left};
  }
};

// The sphere around the center of one that the center of the other bounces off.
template <class S>
Surface<S> sphere_around(const BallPair<S>& p, bool rests) {
  Surface<S> s;
  s.restitution = rests ? S(0.0) : p.restitution;
  s.radius = p.one.radius + p.other.radius;
  for (S& a : s.size) a = S(0.0);
  for (Pose<S>* pose : {&s.now, &s.next})
    for (int k = 0; k < 9; ++k) pose->turn[k] = S(k % 4 == 0 ? 1.0 : 0.0);
  return s;
}

// The share of the inverse mass of two balls that joints must leave; with less, the push counts the masses alone. Joints that link the two and leave less than
// a fifth end the approach themselves. What sweeps and long substeps leave of the approach is an error of these joints, which no push should reverse.
inline constexpr double least_yielding = 1e-9, least_yielding_of_linked = 0.2;

// Deeper than this share of their radii together, overlapping balls hit each other: rounding is no impact.
inline constexpr double no_overlap = 1e-12;

inline std::optional<BallMeeting> meeting_of(const ImpactRule& rule, const BallPair<double>& p) {
  const Flight<double> f = Together<double>(rule.curved, p).apart;
  const Surface<double> s = sphere_around(p, false);
  const Vec3<double> way = f.x_end - f.x;
  const double bent = rule.curved ? 0.125 * f.left * norm(f.v_end - f.v) : 0.0;
  if (!(f.left > 0.0) || norm(f.x) - s.radius > norm(way) + bent) return {};
  const auto at = [&](double t) { return Approach<double>(rule, f, s, t); };
  const auto overlap = [&](double t) { return at(t).gap < -no_overlap * s.radius; };
  // The nearest on a straight path; a curved one may lead back.
  const double squared = dot(way, way);
  double nearest = squared > 0.0 ? std::clamp(-dot(f.x, way) / squared, 0.0, 1.0) * f.left : 0.0;
  if (!overlap(nearest)) nearest = f.left;
  if (!overlap(nearest)) return {};
  BallMeeting found{0.0, true, false};
  if (const Approach<double> start = at(0.0); !(start.gap < 0.0))
    found.time = time_of_impact(rule, f, s, 0.0, nearest);
  else if (!(start.rate < 0.0))
    return {};
  else if (const double earliest = -longest_overdue * rule.h; !(at(earliest).gap < 0.0))
    found.time = time_of_impact(rule, f, s, earliest, 0.0);
  else
    found.dated = false;
  const auto approach = [&] {
    const Approach<double> a = at(found.time);
    return a.rate < 0.0 && dot(a.normal, a.velocity) < 0.0;
  };
  if (!approach() && found.time < 0.0) found = {0.0, false, false};
  if (!approach()) return {};
  found.rests = !bounces(rule, f, s, found.time);
  return found;
}

// By how much more two push each other that are joined to others. What nothing can move along n is pushed as if it were alone.
template <class S>
S joined_push(const BallPair<S>& p, const Vec3<S>& n) {
  const S free = S(1.0) / p.one.mass + S(1.0) / p.other.mass;
  const S rest = free - (n.x * dot(p.D[0], n) + n.y * dot(p.D[1], n) + n.z * dot(p.D[2], n));
  const double least = p.linked ? least_yielding_of_linked : least_yielding;
  return value_of(rest) > least * value_of(free) ? free / rest : S(1.0);
}

// Both flights after a meeting, whose time one step of Newton's method makes that of a scalar with tangents.
template <class S>
std::array<Flight<S>, 2> collided(const ImpactRule& rule, const BallPair<S>& p, const BallMeeting& meeting) {
  const Together<S> both(rule.curved, p);
  const Surface<S> s = sphere_around(p, meeting.rests);
  S t(meeting.time);
  if (meeting.dated) {
    const Approach<S> near(rule, both.apart, s, t);
    t = t - near.gap / near.rate;
  }
  const Approach<S> a(rule, both.apart, s, t);
  Vec3<S> kick = (S(1.0) / (p.one.mass + p.other.mass)) * kick_of(a, s);
  if (p.joined) kick = joined_push(p, a.normal) * kick;
  const auto after = [&](const Flight<S>& f, const Vec3<S>& own) {
    return kicked(Moment<S>(rule.curved, f, t), f, t, own);
  };
  return {after(both.one, p.other.mass * kick), after(both.other, -(p.one.mass * kick))};
}

}  // namespace sheetbend
