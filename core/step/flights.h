// The flights of a substep: of a particle from its state at n to its free end, and what it may bounce off.
#pragma once

#include "core/solver/joined_balls.h"
#include "core/step/step.h"

namespace sheetbend {

inline constexpr int most_impacts = 16;  // of a particle in a substep; what comes after them does not bounce in it

// With a collider, and of balls with each other.
template <class T>
ImpactRule rule_of(const ContactSource<T>& source, int contact) {
  return {source.scene.colliders[source.scene.contacts[contact].collider].any(), source.h, source.bdf.before != 0.0};
}
template <class T>
ImpactRule rule_of_balls(const ContactSource<T>& source) {
  static const int sphere = shape_of(Sphere::name);
  return {sphere, source.h, source.bdf.before != 0.0};
}

// From the state at n to the free end y.
template <class T>
Flight<Single<T>> flight_of(const ContactSource<T>& source, int node, const Vec3<Single<T>>& y) {
  using S = Single<T>;
  Flight<S> f{source.at(source.from.x, node), source.at(source.from.v, node), y, {}, S(source.h)};
  f.v_end = S((source.bdf.before == 0.0 ? 1.0 : 2.0) / source.h) * (y - f.x);
  if (source.bdf.before != 0.0) f.v_end = f.v_end - f.v;
  return f;
}

// A ball of Scene::balls in a flight.
template <class T>
Ball<Single<T>> ball_of(const ContactSource<T>& source, int ball, const Flight<Single<T>>& flight) {
  const Balls& balls = source.scene.balls;
  return {flight, source.read(source.in.of(Quantity::contact_radius)[balls.first_radius + ball]),
          source.read(source.in.of(Quantity::mass)[balls.members[ball].node])};
}
// Two that hit each other, balls i and k.
template <class T>
BallPair<Single<T>> pair_of(const ContactSource<T>& source, const Plan& plan, int i, int k, const Flight<Single<T>>& f,
                            const Flight<Single<T>>& g) {
  BallPair<Single<T>> pair{ball_of(source, i, f), ball_of(source, k, g),
                           source.read(source.in.of(Quantity::restitution)[source.scene.balls.restitution])};
  if (const auto D = taken_of(source, plan, i, k)) pair.joined = true, pair.D = *D;
  pair.linked = pair.joined && plan.assembly_of_ball[i] == plan.assembly_of_ball[k];
  return pair;
}

}  // namespace sheetbend
