// The velocity that the corrected coordinates imply, v = (q - history(x))/eta; and q to x_next.
#pragma once

#include <atomic>

#include "core/step/stages.h"

namespace sheetbend {

struct UpdateVelocities {
  static constexpr bool repeated = false;
  template <class T>
  using Record = Nothing;

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Nothing&) {
    std::atomic<bool> finite = true;
    // q - q, which only what is finite has as zero
    if constexpr (std::is_same_v<T, double>) {
      const double rate = 1.0 / step.bdf.eta;
      const int* first_dof = step.scene.first_dof.data();
      const Coordinates<T> q = work.q;
      const Bdf bdf = step.bdf;
      const SubstepStates<T> s = step.from;
      T *x_next = work.x_next, *v = work.v_next;
      parallel_for(step.scene.nodes(), step.threads(), points_per_thread, [=, &finite](int begin, int end) {
        PointSum<T> difference;
        for_each_point<T>(begin, end, [=, &difference](int n, auto how) {
          const int dof = first_dof[n];
          const auto now = how.load(q.of(n));
          how.store(x_next + dof, now);
          how.store(v + dof, scaled(rate, now - history(bdf, how, s.x + dof, s.x_before + dof)));
          difference.add(now - now);
        });
        const Vec3<T> d = difference.total();
        if (!all_finite(d.x) || !all_finite(d.y) || !all_finite(d.z)) finite = false;
      });
    } else {
      const auto points = points_of(step, work.masses, &work);
      parallel_for(step.scene.nodes(), step.threads(), points_per_thread, [&](int begin, int end) {
        if (!point_kernels<T>().update_velocities(points, begin, end)) finite = false;
      });
    }
    work.finite = finite;
  }
};

}  // namespace sheetbend
