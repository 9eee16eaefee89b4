// The reverses of Bounce and LeaveImpacts: through a particle's impacts, last to first, to its free end, to its state at n, and to the inputs.
#pragma once

#include <algorithm>
#include <ranges>

#include "adjoint/solver/contact_source_vjp.h"
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
    auto& impacts = record.impacts;
    for (int lane = 0; lane < scenes_of<T>; ++lane) {
      if (!has(step.scenes, lane)) continue;
      const auto own = [&](const auto& impact) { return impact.lane == lane; };
      if (std::none_of(impacts.begin(), impacts.end(), own)) continue;
      const ContactSource<T> source = contact_source(step, work.masses, lane);
      const auto poses = source.poses();
      auto poses_bar = no_pose_cotangents(source);
      for (auto last = impacts.rbegin(); last != impacts.rend();) {
        auto end = std::find_if(last, impacts.rend(),
                                [&](const auto& i) { return i.node != last->node || i.lane != last->lane; });
        if (own(*last)) particle(source, poses, std::ranges::subrange(last, end), poses_bar, bar);
        last = end;
      }
      poses_vjp(source, poses_bar, bar.in);
    }
  }

 private:
  template <class T, class Impacts>
  static void particle(const ContactSource<T>& source, const ColliderPoses<Single<T>>& poses, const Impacts& impacts,
                       ColliderPoses<Single<T>>& poses_bar, const StepCotangents<T>& bar) {
    using S = Single<T>;
    const int node = impacts.begin()->node, dof = source.scene.first_dof[node];
    const S rate(1.0 / source.bdf.eta);
    // v = v_end + (x_next - x_end)/eta, where UpdateVelocities has (x_next - history)/eta.
    const Vec3<S> v_bar = source.at(bar.v_next, node), back = rate * v_bar;
    source.add(S(source.bdf.now) * back, bar.from.x + dof);
    if (source.bdf.before != 0.0) source.add(S(source.bdf.before) * back, bar.from.x_before + dof);
    Flight<S> f_bar{};
    f_bar.x_end = source.read(Vec3<T>(bar.q.of(node))) - back;
    f_bar.v_end = v_bar;
    for (const auto& impact : impacts) {
      Surface<S> surface_bar{};
      f_bar = bounced_vjp(Bounce::rule(source, impact.contact), impact.before, source.surface(poses, impact.contact),
                          impact.time, f_bar, surface_bar);
      surface_vjp(source, impact.contact, surface_bar, poses_bar, bar.in);
    }
    // Bounce::flight: v_end = c (y - x), of BDF2 less v.
    const Vec3<S> end_bar = S((source.bdf.before == 0.0 ? 1.0 : 2.0) / source.h) * f_bar.v_end;
    source.write(f_bar.x_end + end_bar, bar.q.of(node));
    source.add(f_bar.x - end_bar, bar.from.x + dof);
    source.add(source.bdf.before == 0.0 ? f_bar.v : f_bar.v - f_bar.v_end, bar.from.v + dof);
  }
};

}  // namespace sheetbend
