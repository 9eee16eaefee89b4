// The reverses of Bounce and LeaveImpacts: through the impacts, last to first, to the particles' free ends, to their states at n, and to the inputs.
#pragma once

#include <algorithm>
#include <map>

#include "adjoint/solver/contact_source_vjp.h"
#include "adjoint/solver/joined_balls_vjp.h"
#include "adjoint/step/stages.h"
#include "core/step/bounce.h"

namespace sheetbend {

// That of UpdateVelocities takes the velocity to be read off the positions; ReverseOf<Bounce> adds what is different.
template <>
struct ReverseOf<LeaveImpacts> {
  template <class T>
  using Scratch = Nothing;
  template <class T>
  static void run(const Step<T>&, const Work<T>&, Nothing&, Nothing&, const StepCotangents<T>&) {}
};

template <>
struct ReverseOf<Bounce> {
  template <class T>
  using Scratch = Nothing;

  template <class T>
  static void run(const Step<T>& step, const Work<T>& work, Bounce::Record<T>& record, Nothing&,
                  const StepCotangents<T>& bar) {
    const auto& impacts = record.impacts;
    for (int lane = 0; lane < scenes_of<T>; ++lane) {
      if (!has(step.scenes, lane)) continue;
      if (std::ranges::none_of(impacts, [&](const auto& impact) { return impact.lane == lane; })) continue;
      const ContactSource<T> source = contact_source(step, work.masses, lane);
      const auto& poses = (*work.poses)[lane];
      auto poses_bar = no_pose_cotangents(source);
      std::map<int, Flight<Single<T>>> flights;  // cotangents, by node
      for (auto impact = impacts.rbegin(); impact != impacts.rend(); ++impact) {
        if (impact->lane != lane) continue;
        for (const auto& f : impact->flown())
          if (!flights.contains(f.node)) flights.emplace(f.node, last_flight(source, f.node, bar));
        reverse(source, step.plan, poses, *impact, flights, poses_bar, bar);
      }
      for (const auto& [node, f_bar] : flights) first_flight(source, node, f_bar, bar);
      poses_vjp(source, poses_bar, bar.in);
    }
  }

 private:
  template <class T>
  static void reverse(const ContactSource<T>& source, const Plan& plan, const ColliderPoses<Single<T>>& poses,
                      const Impact<Single<T>>& impact, std::map<int, Flight<Single<T>>>& flights,
                      ColliderPoses<Single<T>>& poses_bar, const StepCotangents<T>& bar) {
    using S = Single<T>;
    const Inputs<T>& in_bar = bar.in;
    const auto& [one, other] = impact.both;
    if (impact.contact >= 0) {
      Surface<S> surface_bar{};
      Flight<S>& f_bar = flights.at(one.node);
      f_bar = bounced_vjp(rule_of(source, impact.contact), one.before, source.surface(poses, impact.contact),
                          impact.meeting.time, f_bar, surface_bar);
      return surface_vjp(source, impact.contact, surface_bar, poses_bar, in_bar);
    }
    const BallPair<S> pair = pair_of(source, plan, one.ball, other.ball, one.before, other.before);
    const BallPair<S> pair_bar =
        collided_vjp(rule_of_balls(source), pair, impact.meeting, {flights.at(one.node), flights.at(other.node)});
    const Balls& balls = source.scene.balls;
    const auto back = [&](const Flown<S>& own, const Ball<S>& ball_bar) {
      flights.at(own.node) = ball_bar.flight;
      source.add(ball_bar.radius, in_bar.of(Quantity::contact_radius)[balls.first_radius + own.ball]);
      source.add(ball_bar.mass, in_bar.of(Quantity::mass)[own.node]);
    };
    back(one, pair_bar.one), back(other, pair_bar.other);
    source.add(pair_bar.restitution, in_bar.of(Quantity::restitution)[balls.restitution]);
    if (pair.joined) taken_vjp(source, plan, one.ball, other.ball, pair_bar.D, bar.from.x, in_bar);
  }

  // v = v_end + (x_next - x_end)/eta, where UpdateVelocities has (x_next - history)/eta.
  template <class T>
  static Flight<Single<T>> last_flight(const ContactSource<T>& source, int node, const StepCotangents<T>& bar) {
    using S = Single<T>;
    const int dof = source.scene.first_dof[node];
    const S rate(1.0 / source.bdf.eta);
    const Vec3<S> v_bar = source.at(bar.v_next, node), back = rate * v_bar;
    source.add(S(source.bdf.now) * back, bar.from.x + dof);
    if (source.bdf.before != 0.0) source.add(S(source.bdf.before) * back, bar.from.x_before + dof);
    Flight<S> f_bar{};
    f_bar.x_end = source.read(Vec3<T>(bar.q.of(node))) - back;
    f_bar.v_end = v_bar;
    return f_bar;
  }

  // flight_of: v_end = c (y - x), of BDF2 less v.
  template <class T>
  static void first_flight(const ContactSource<T>& source, int node, const Flight<Single<T>>& f_bar,
                           const StepCotangents<T>& bar) {
    using S = Single<T>;
    const int dof = source.scene.first_dof[node];
    const Vec3<S> end_bar = S((source.bdf.before == 0.0 ? 1.0 : 2.0) / source.h) * f_bar.v_end;
    source.write(f_bar.x_end + end_bar, bar.q.of(node));
    source.add(f_bar.x - end_bar, bar.from.x + dof);
    source.add(source.bdf.before == 0.0 ? f_bar.v : f_bar.v - f_bar.v_end, bar.from.v + dof);
  }
};

}  // namespace sheetbend
