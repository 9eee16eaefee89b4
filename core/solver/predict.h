// Where a substep starts: effective masses, and the positions that free motion would give.
#pragma once

#include <vector>

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

template <class T>
T history(const Bdf& bdf, const T& now, const T& before) {
  return bdf.before == 0.0 ? now : T(bdf.now) * now + T(bdf.before) * before;
}

template <class T, class How>
typename How::Point history(const Bdf& bdf, How, const T* now, const T* before) {
  if (bdf.before == 0.0) return How::load(now);
  return scaled(bdf.now, How::load(now)) + scaled(bdf.before, How::load(before));
}

// out = history(now, before) + c more, for scalars other than double.
template <class T>
void add_to_history(const Bdf& bdf, const T* now, const T* before, double c, const T* more, T* out) {
  const double *a = numbers_of_point(now), *b = numbers_of_point(before), *m = numbers_of_point(more);
  double* __restrict to = numbers_of_point(out);
  for (int i = 0; i < numbers_per_point<T>; ++i) to[i] = history(bdf, a[i], b[i]) + c * m[i];
}

// Value of something given at knots, (knots, slots, 3), for one slot.
template <class T>
Vec3<T> at_knots(const KnotWeights& k, const T* values, int slots, int slot) {
  Vec3<T> sum;
  for (int i = 0; i < k.count; ++i)
    sum = sum + T(k.weight[i]) * Vec3<T>(values + 3 * ((static_cast<std::size_t>(k.first) + i) * slots + slot));
  return sum;
}

// Where what was at n and n-1 goes on to: the velocity that quadratic drag is linearized at, and a director's prediction.
template <class T>
Vec3<T> extrapolated(const Bdf& bdf, const T* now, const T* before) {
  return T(bdf.extrapolate_now) * Vec3<T>(now) + T(bdf.extrapolate_before) * Vec3<T>(before);
}

// Drag c = c1 + c2 |v| is implicit: it adds eta c to the mass that this substep's projections see, so the reaction of the constraints feels it.
template <class T>
void weigh(const Scene& scene, const Inputs<const T>& in, const Bdf& bdf, const SubstepStates<T>& s,
           Weights<T>& weights) {
  if (weights.eta == bdf.eta && !scene.has_drag) return;
  weights.eta = bdf.eta;
  const T* mass = in.of(Quantity::mass);
  const T eta(bdf.eta);
  for (int n = 0; n < scene.nodes(); ++n) {
    if (scene.role[n] != Role::free) {
      weights.w[n] = T(0.0);
      continue;
    }
    if (!scene.inertial[n]) {
      weights.w[n] = T(1.0) / (mass[n] * eta * eta);
      continue;
    }
    T effective = mass[n];
    if (scene.has_drag) {
      const Vec3<T> v = extrapolated(bdf, s.v + scene.first_dof[n], s.v_before + scene.first_dof[n]);
      effective +=
          eta * (in.of(Quantity::drag_linear)[n] + in.of(Quantity::drag_quadratic)[n] * sqrt_or_zero(dot(v, v)));
    }
    weights.w[n] = T(1.0) / effective;
    if (scene.has_drag) weights.kept[n] = mass[n] * weights.w[n];
  }
}

// Loops over particles capture by value: a store may go anywhere, so what a reference leads to would be loaded again for each.
//
// x* = history(x) + eta v*, v* = m w (history(v) + eta gravity) + w eta f, w = 1/(m + eta c). Directors go on as
// they turned, driven nodes go where their boundary is.
template <class T>
void predict(const Scene& scene, const Inputs<const T>& in, const Bdf& bdf, double t_next, const SubstepStates<T>& s,
             const Weights<T>& weights, int threads, const Coordinates<T>& q) {
  const T eta(bdf.eta);
  const T gravity[4] = {eta * in.of(Quantity::gravity)[0], eta * in.of(Quantity::gravity)[1],
                        eta * in.of(Quantity::gravity)[2], T(0.0)};
  const double step = bdf.eta;
  const T* kept = scene.has_drag ? weights.kept.data() : nullptr;
  const int* first_dof = scene.first_dof.data();
  parallel_for(scene.nodes(), threads, points_per_thread, [=](int begin, int end) {
    if constexpr (std::is_same_v<T, double>) {
      for_each_point<T>(begin, end, [=](int n, auto how) {
        const int dof = first_dof[n];
        auto v = history(bdf, how, s.v + dof, s.v_before + dof) + how.load(gravity);
        if (kept) v = scaled(kept[n], v);
        how.store(q.of(n), history(bdf, how, s.x + dof, s.x_before + dof) + scaled(step, v));
      });
    } else {
      for (int n = begin; n < end; ++n) {
        const int dof = first_dof[n];
        T v[3];
        add_to_history(bdf, s.v + dof, s.v_before + dof, 1.0, gravity, v);
        if (kept)
          for (T& component : v) component = kept[n] * component;
        add_to_history(bdf, s.x + dof, s.x_before + dof, step, v, q.of(n));
      }
    }
  });
  if (!scene.loaded.empty()) {
    const KnotWeights force = scene.force.at(t_next);
    for (std::size_t i = 0; i < scene.loaded.size(); ++i) {
      const int n = scene.loaded[i];
      const Vec3<T> f =
          at_knots(force, in.of(Quantity::force), static_cast<int>(scene.loaded.size()), static_cast<int>(i));
      (eta * (weights.w[n] * (eta * f))).add_to(q.of(n));
    }
  }
  for (const Director& d : scene.directors) {
    const int dof = scene.first_dof[d.node];
    extrapolated(bdf, s.x + dof, s.x_before + dof).store(q.of(d.node));
  }
  for (const int n : scene.pinned) Vec3<T>(s.x + scene.first_dof[n]).store(q.of(n));
  if (scene.driven.empty()) return;
  const KnotWeights boundary = scene.boundary.at(t_next);
  for (std::size_t i = 0; i < scene.driven.size(); ++i)
    at_knots(boundary, in.of(Quantity::boundary), static_cast<int>(scene.driven.size()), static_cast<int>(i))
        .store(q.of(scene.driven[i]));
}

}  // namespace sheetbend
