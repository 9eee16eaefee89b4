// Particles that no constraint holds bounce off colliders with restitution (core/contact/impact.h), and balls hit each other (core/step/ball_flights.h),
// whether constraints hold them or not: those move them afterwards.
// Where the free end of a substep is past a surface that its start was not, the projection begins at the end of the flight that the impact leaves, outside the
// surface; other contacts act from there. An approach that is too slow to bounce is left to the projection as a contact without restitution.
#pragma once

#include "core/step/ball_flights.h"
#include "core/step/stages.h"

namespace sheetbend {

struct Bounce {
  static constexpr bool repeated = true;

  template <class T>
  struct Record {
    std::vector<Impact<Single<T>>> impacts;  // of each particle in the order in which they happened
    BallFlights<T> balls;                    // keep their memory, as the next one does
    std::vector<int> left;                   // contacts that a particle may still bounce off

    void resize(const Scene&, const Plan&, bool) {}
    static std::size_t bytes(const Scene&, const Plan&, bool) { return 0; }
  };

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Record<T>& record) {
    const Scene& scene = step.scene;
    if (scene.bouncers.empty() && scene.balls.empty()) return;
    std::erase_if(record.impacts, [&](const auto& impact) { return has(step.scenes, impact.lane); });
    for (int lane = 0; lane < scenes_of<T>; ++lane) {
      if (!has(step.scenes, lane)) continue;
      const ContactSource<T> source = contact_source(step, work.masses, lane);
      const auto& poses = (*work.poses)[lane];
      for (const Bouncer& bouncer : scene.bouncers) fly(source, poses, bouncer, work, record);
      if (scene.balls.empty()) continue;
      record.balls.fly(source, step.plan, poses, work.q, record.impacts);
    }
    work.impacts = &record.impacts;
  }

 private:
  template <class T>
  static void fly(const ContactSource<T>& source, const ColliderPoses<Single<T>>& poses, const Bouncer& bouncer,
                  Work<T>& work, Record<T>& record) {
    using S = Single<T>;
    const int node = bouncer.node;
    Flight<S> f = flight_of(source, node, source.read(Vec3<T>(work.q.of(node))));
    std::vector<int>& left = record.left;
    left = bouncer.contacts;
    for (int turn = 0; turn < most_impacts; ++turn) {
      const Flight<double> path = as_values(f);
      int first = -1;
      double t = 0.0;
      for (const int contact : left) {
        const ImpactRule own = rule_of(source, contact);
        const auto surface = as_values(source.surface(poses, contact));
        if (!meets(own, path, surface)) continue;
        const double when = time_of_impact(own, path, surface, 0.0, path.left);
        if (first < 0 || when < t) first = contact, t = when;
      }
      if (first < 0) break;
      const Surface<S> surface = source.surface(poses, first);
      if (!bounces(rule_of(source, first), path, as_values(surface), t)) {
        std::erase(left, first);
        continue;
      }
      const Flight<S> after = bounced(rule_of(source, first), f, surface, t);
      record.impacts.push_back({source.lane, first, {t, true, false}, {Flown<S>{node, -1, f, after}}});
      f = after;
      source.write(f.x_end, work.q.of(node));
    }
  }
};

// After velocities are read off positions: a particle that has bounced has that of the flight which its last impact began, changed as far as the
// projection has moved it.
struct LeaveImpacts {
  static constexpr bool repeated = false;
  template <class T>
  using Record = Nothing;

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Nothing&) {
    using S = Single<T>;
    if (!work.impacts) return;
    const S rate(1.0 / step.bdf.eta);
    for (const Impact<S>& impact : *work.impacts) {
      if (!has(step.scenes, impact.lane)) continue;
      const ContactSource<T> source = contact_source(step, work.masses, impact.lane);
      for (const Flown<S>& f : impact.flown()) {
        const Vec3<S> moved = source.at(work.x_next, f.node) - f.after.x_end;
        source.write(f.after.v_end + rate * moved, work.v_next + step.scene.first_dof[f.node]);
      }
    }
  }
};

}  // namespace sheetbend
