// Where a substep starts: effective masses, and the positions that free motion would give.
#pragma once

#include <vector>

#include "core/packs/packed_colors.h"
#include "core/points/point_kernels.h"
#include "core/scalar/point.h"
#include "core/scene/scene.h"
#include "core/solver/options.h"
#include "core/threads/pool.h"

namespace sheetbend {

// The states that a substep reads.
template <class T>
struct SubstepStates {
  const T *x, *x_before, *v, *v_before;  // at n and n-1 (n-1 unused by BDF1)
  int step = -1;                         // n, by which a rollout's states are known again; -1 where it has none
  const T* x_next = nullptr;             // at n+1, where the reverse of implicit blocks knows it
};

// Coordinates while they are corrected: node n's begin at stride n.
template <class T>
struct Coordinates {
  T* data;
  int stride;
  T* of(int node) const { return data + static_cast<long>(stride) * node; }
};

// The effective inverse masses: w = 1/(m + eta c), of a director 1/(m eta^2), 0 for what cannot move; and with drag the share m w of its
// momentum that a particle keeps.
template <class T>
struct Weights {
  std::vector<T> w, kept;
  double eta = 0.0;  // without drag they are found once per eta
};

template <class T, class How>
typename How::Point history(const Bdf& bdf, How, const T* now, const T* before) {
  if (bdf.before == 0.0) return How::load(now);
  return scaled(bdf.now, How::load(now)) + scaled(bdf.before, How::load(before));
}

// Value of something given at knots, (knots, slots, 3), for one slot.
template <class T>
Vec3<T> at_knots(const KnotWeights& k, const T* values, int slots, int slot) {
  Vec3<T> sum;
  for (int i = 0; i < k.count; ++i)
    sum = sum + scaled(k.weight[i], Vec3<T>(values + 3 * ((static_cast<std::size_t>(k.first) + i) * slots + slot)));
  return sum;
}

// Where what was at n and n-1 goes on to: the velocity that quadratic drag is linearized at, and a director's prediction.
template <class T>
Vec3<T> extrapolated(const Bdf& bdf, const T* now, const T* before) {
  return T(bdf.extrapolate_now) * Vec3<T>(now) + T(bdf.extrapolate_before) * Vec3<T>(before);
}

// The kernels for T: of this machine's instruction set for lanes and for duals of forward rollouts, otherwise compiled where they are used.
template <class T>
const sheetbend_points::Kernels& point_kernels() {
  if constexpr (std::is_same_v<T, Pack>)
    return pack_kernels().points->lanes;
  else if constexpr (std::is_same_v<T, Dual<double, 4>>)
    return pack_kernels().points->four_directions;
  else if constexpr (std::is_same_v<T, Dual<double, 8>>)
    return pack_kernels().points->eight_directions;
  else
    return PointKernels<T>::all;
}

// What the kernels read, and the weights that they write; where coordinates go is left open.
template <class T>
sheetbend_points::Points points_of(const Scene& scene, const Inputs<const T>& in, const Bdf& bdf,
                                   const SubstepStates<T>& s, Weights<T>& weights) {
  const auto read = [](const T* from) { return reinterpret_cast<const double*>(from); };
  const auto write = [](std::vector<T>& to) { return reinterpret_cast<double*>(to.data()); };
  sheetbend_points::Points p{};
  p.eta = bdf.eta;
  p.now = bdf.now;
  p.before = bdf.before;
  p.extrapolate_now = bdf.extrapolate_now;
  p.extrapolate_before = bdf.extrapolate_before;
  p.inertial = scene.inertial.data();
  p.director = scene.is_director.data();
  p.x = read(s.x);
  p.x_before = read(s.x_before);
  p.v = read(s.v);
  p.v_before = read(s.v_before);
  p.mass = read(in.of(Quantity::mass));
  p.drag_linear = read(in.of(Quantity::drag_linear));
  p.drag_quadratic = read(in.of(Quantity::drag_quadratic));
  p.gravity = read(in.of(Quantity::gravity));
  p.w = write(weights.w);
  p.kept = scene.has_drag ? write(weights.kept) : nullptr;
  return p;
}

// Drag c = c1 + c2 |v| is implicit: it adds eta c to the mass that this substep's projections see, so the reaction of the constraints feels it.
template <class T>
void weigh(const Scene& scene, const Inputs<const T>& in, const Bdf& bdf, const SubstepStates<T>& s,
           Weights<T>& weights) {
  if (weights.eta != bdf.eta) {
    weights.eta = bdf.eta;
    const T* mass = in.of(Quantity::mass);
    const T eta(bdf.eta);
    for (int n = 0; n < scene.nodes(); ++n)
      weights.w[n] = scene.inertial[n]             ? T(1.0) / mass[n]
                     : scene.role[n] == Role::free ? T(1.0) / (mass[n] * eta * eta)
                                                   : T(0.0);
  }
  if (scene.has_drag) point_kernels<T>().weigh(points_of(scene, in, bdf, s, weights), 0, scene.nodes());
}

// Loops over particles capture by value: a store may go anywhere, so what a reference leads to would be loaded again for each.
//
// x* = history(x) + eta v*, v* = m w (history(v) + eta gravity) + w eta f, w = 1/(m + eta c). Directors go on as
// they turned, driven nodes go where their boundary is.
template <class T>
void predict(const Scene& scene, const Inputs<const T>& in, const Bdf& bdf, double t_next, const SubstepStates<T>& s,
             Weights<T>& weights, int threads, const Coordinates<T>& q) {
  const T eta(bdf.eta);
  if constexpr (std::is_same_v<T, double>) {
    const double gravity[4] = {eta * in.of(Quantity::gravity)[0], eta * in.of(Quantity::gravity)[1],
                               eta * in.of(Quantity::gravity)[2], 0.0};
    const double* kept = scene.has_drag ? weights.kept.data() : nullptr;
    const int* first_dof = scene.first_dof.data();
    parallel_for(scene.nodes(), threads, points_per_thread, [=](int begin, int end) {
      for_each_point<T>(begin, end, [=](int n, auto how) {
        const int dof = first_dof[n];
        auto v = history(bdf, how, s.v + dof, s.v_before + dof) + how.load(gravity);
        if (kept) v = scaled(kept[n], v);
        how.store(q.of(n), history(bdf, how, s.x + dof, s.x_before + dof) + scaled(eta, v));
      });
    });
    for (const Director& d : scene.directors) {
      const int dof = scene.first_dof[d.node];
      extrapolated(bdf, s.x + dof, s.x_before + dof).store(q.of(d.node));
    }
  } else {
    auto points = points_of(scene, in, bdf, s, weights);
    points.q = reinterpret_cast<double*>(q.data);
    points.stride = q.stride;
    parallel_for(scene.nodes(), threads, points_per_thread,
                 [&](int begin, int end) { point_kernels<T>().predict(points, begin, end); });
  }
  if (!scene.loaded.empty()) {
    const KnotWeights force = scene.force.at(t_next);
    for (std::size_t i = 0; i < scene.loaded.size(); ++i) {
      const int n = scene.loaded[i];
      if (!scene.inertial[n]) continue;
      const Vec3<T> f =
          at_knots(force, in.of(Quantity::force), static_cast<int>(scene.loaded.size()), static_cast<int>(i));
      (eta * (weights.w[n] * (eta * f))).add_to(q.of(n));
    }
  }
  for (const int n : scene.pinned) Vec3<T>(s.x + scene.first_dof[n]).store(q.of(n));
  if (scene.driven.empty()) return;
  const KnotWeights boundary = scene.boundary.at(t_next);
  const std::size_t slots = scene.driven.size();
  const T* values = in.of(Quantity::boundary) + 3 * slots * boundary.first;
  for (std::size_t i = 0; i < slots; ++i)
    point_kernels<T>().interpolate(reinterpret_cast<const double*>(values + 3 * i), 3 * slots, boundary.weight.data(),
                                   boundary.count, reinterpret_cast<double*>(q.of(scene.driven[i])));
}

}  // namespace sheetbend
