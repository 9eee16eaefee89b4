// Where a substep starts: the positions that free motion would give,
//
//   x* = history(x) + eta v*,   v* = u + m w (history(v) - u + eta gravity),   w = 1/(m + eta c),
//
// where drag c is against a wind u; without drag m w = 1.
//
// Axes of bodies have no weight, directors go on as they turned, pinned nodes stay, driven ones go where their boundary is at the substep's end.
#pragma once

#include "core/step/stages.h"

namespace sheetbend {

struct Predict {
  static constexpr bool repeated = true;
  template <class T>
  using Record = Nothing;

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Nothing&) {
    if constexpr (std::is_same_v<T, double>)
      free_motion(step, work);
    else
      parallel_for(step.scene.nodes(), step.threads(), points_per_thread,
                   [points = points_of(step, work.masses, &work)](int begin, int end) {
                     point_kernels<T>().predict(points, begin, end);
                   });
    weightless_nodes(step, work);
    fixed_nodes(step, work);
  }

 private:
  // Loops over particles capture by value: a store may go anywhere, so what a reference leads to would be loaded again for each.
  static void free_motion(const Step<double>& step, Work<double>& work) {
    const Scene& scene = step.scene;
    const double eta = step.bdf.eta, *g = step.in.of(Quantity::gravity);
    const Vec3<double> u = work.masses.wind;
    const double wind[4] = {u.x, u.y, u.z, 0.0};
    const double added[4] = {eta * g[0] - u.x, eta * g[1] - u.y, eta * g[2] - u.z, 0.0};
    const double* kept = scene.has_drag ? work.masses.kept.data() : nullptr;
    const int* first_dof = scene.first_dof.data();
    const Coordinates<double> q = work.q;
    const Bdf bdf = step.bdf;
    const SubstepStates<double> s = step.from;
    parallel_for(scene.nodes(), step.threads(), points_per_thread, [=](int begin, int end) {
      for_each_point<double>(begin, end, [=](int n, auto how) {
        const int dof = first_dof[n];
        auto v = history(bdf, how, s.v + dof, s.v_before + dof) + how.load(added);
        if (kept) v = scaled(kept[n], v) + how.load(wind);
        how.store(q.of(n), history(bdf, how, s.x + dof, s.x_before + dof) + scaled(eta, v));
      });
    });
    for (const Director& d : scene.directors) {
      const int dof = scene.first_dof[d.node];
      extrapolated(bdf, s.x + dof, s.x_before + dof).store(q.of(d.node));
    }
  }

  // Again, without gravity and wind.
  template <class T>
  static void weightless_nodes(const Step<T>& step, Work<T>& work) {
    const Scene& scene = step.scene;
    const Exactly<T> how;
    for (const int n : scene.axes) {
      const int dof = scene.first_dof[n];
      Vec3<T> v = history(step.bdf, how, step.from.v + dof, step.from.v_before + dof);
      if (scene.has_drag) v = work.masses.kept[n] * v;
      (history(step.bdf, how, step.from.x + dof, step.from.x_before + dof) + T(step.bdf.eta) * v).store(work.q.of(n));
    }
  }

  template <class T>
  static void fixed_nodes(const Step<T>& step, Work<T>& work) {
    const Scene& scene = step.scene;
    for (const int n : scene.pinned) Vec3<T>(step.from.x + scene.first_dof[n]).store(work.q.of(n));
    if (scene.driven.empty()) return;
    const KnotWeights boundary = scene.boundary.at(step.t_next);
    const std::size_t slots = scene.driven.size();
    const T* values = step.in.of(Quantity::boundary) + 3 * slots * boundary.first;
    for (std::size_t i = 0; i < slots; ++i)
      point_kernels<T>().interpolate(reinterpret_cast<const double*>(values + 3 * i), 3 * slots, boundary.weight.data(),
                                     boundary.count, reinterpret_cast<double*>(work.q.of(scene.driven[i])));
  }
};

}  // namespace sheetbend
