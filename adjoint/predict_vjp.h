// The reverse of a substep's ends: the velocity read-off, and the prediction with its effective masses.
#pragma once

#include "core/solver/predict.h"

namespace sheetbend {

// Cotangents of the states at n and n-1, accumulated.
template <class T>
struct StateCotangents {
  T *x, *x_before, *v, *v_before;
};

// One number per node, `stride` apart.
template <class T>
struct Strided {
  T* data;
  int stride;
  T& of(int node) const { return data[static_cast<long>(stride) * node]; }
};

template <class T, class How>
void pull_back_history(const Bdf& bdf, How, const typename How::Point& bar, T* now_bar, T* before_bar) {
  if (bdf.before == 0.0) return How::add(now_bar, bar);
  How::add(now_bar, scaled(T(bdf.now), bar));
  How::add(before_bar, scaled(T(bdf.before), bar));
}

// Reverse of extrapolated().
template <class T>
void pull_back_extrapolated(const Bdf& bdf, const Vec3<T>& bar, T* now_bar, T* before_bar) {
  (T(bdf.extrapolate_now) * bar).add_to(now_bar);
  if (bdf.extrapolate_before != 0.0) (T(bdf.extrapolate_before) * bar).add_to(before_bar);
}

template <class T>
void pull_back_knots(const KnotWeights& k, const Vec3<T>& bar, T* values_bar, int slots, int slot) {
  for (int i = 0; i < k.count; ++i)
    (T(k.weight[i]) * bar).add_to(values_bar + 3 * ((static_cast<std::size_t>(k.first) + i) * slots + slot));
}

// Reverse of read_off(): writes the cotangent of q.
template <class T>
void read_off_vjp(const Scene& scene, const Bdf& bdf, const T* x_next_bar, const T* v_next_bar, int threads,
                  const Coordinates<T>& q_bar, const StateCotangents<T>& bar) {
  const T rate(1.0 / bdf.eta);
  const int* first_dof = scene.first_dof.data();
  parallel_for(scene.nodes(), threads, points_per_thread, [=](int begin, int end) {
    for_each_point<T>(begin, end, [=](int n, auto how) {
      const int dof = first_dof[n];
      const auto back = scaled(rate, how.load(v_next_bar + dof));
      how.store(q_bar.of(n), how.load(x_next_bar + dof) + back);
      pull_back_history(bdf, how, -back, bar.x + dof, bar.x_before + dof);
    });
  });
}

// Reverse of predict() and weigh(), given the cotangents of q and w. gravity_bars is scratch.
template <class T>
void predict_vjp(const Scene& scene, const Inputs<const T>& in, const Bdf& bdf, double t_next,
                 const SubstepStates<T>& s, const Weights<T>& weights, const Coordinates<T>& q_bar,
                 const Strided<T>& w_bar, int threads, std::vector<Vec3<T>>& gravity_bars,
                 const StateCotangents<T>& bar, const Inputs<T>& in_bar) {
  const Vec3<T> gravity(in.of(Quantity::gravity));
  const T eta(bdf.eta);
  const std::vector<T>& w = weights.w;
  T* mass_bar = in_bar.of(Quantity::mass);
  // q = history(x) + eta v*, v* = m w (history(v) + eta g) + w eta f. The sum for g goes by chunks of one size, whoever works on them.
  constexpr int points_per_sum = 1024;
  const int chunks = (scene.nodes() + points_per_sum - 1) / points_per_sum;
  gravity_bars.resize(chunks);
  const T* kept = scene.has_drag ? weights.kept.data() : nullptr;
  const int *first_dof = scene.first_dof.data(), nodes = scene.nodes();
  const char* inertial = scene.inertial.data();
  const T* inverse_mass = w.data();
  Vec3<T>* sums = gravity_bars.data();
  parallel_for(chunks, threads, 1, [=](int first, int last) {
    for (int chunk = first; chunk < last; ++chunk) {
      PointSum<T> sum;
      const int begin = chunk * points_per_sum, end = std::min(begin + points_per_sum, nodes);
      for_each_point<T>(begin, end, [=, &sum](int n, auto how) {
        if (!inertial[n]) return;
        const int dof = first_dof[n];
        const auto x_bar = how.load(q_bar.of(n));
        auto v_bar = scaled(eta, x_bar);
        if (kept) v_bar = scaled(kept[n], v_bar);
        pull_back_history(bdf, how, x_bar, bar.x + dof, bar.x_before + dof);
        pull_back_history(bdf, how, v_bar, bar.v + dof, bar.v_before + dof);
        sum.add(scaled(eta, v_bar));
        mass_bar[n] -= inverse_mass[n] * inverse_mass[n] * w_bar.of(n);
      });
      sums[chunk] = sum.total();
    }
  });
  for (const Vec3<T>& sum : gravity_bars) sum.add_to(in_bar.of(Quantity::gravity));

  for (const Director& d : scene.directors) {
    if (scene.role[d.node] != Role::free) continue;
    const Vec3<T> x_bar(q_bar.of(d.node));
    pull_back_extrapolated(bdf, x_bar, bar.x + scene.first_dof[d.node], bar.x_before + scene.first_dof[d.node]);
    mass_bar[d.node] -= w[d.node] * w[d.node] * eta * eta * w_bar.of(d.node);
  }
  for (const int n : scene.pinned) Vec3<T>(q_bar.of(n)).add_to(bar.x + scene.first_dof[n]);
  if (!scene.driven.empty()) {
    const KnotWeights boundary = scene.boundary.at(t_next);
    for (std::size_t i = 0; i < scene.driven.size(); ++i)
      pull_back_knots(boundary, Vec3<T>(q_bar.of(scene.driven[i])), in_bar.of(Quantity::boundary),
                      static_cast<int>(scene.driven.size()), static_cast<int>(i));
  }
  // What a force and drag add: d(m w)/dm = w^2 eta c, dw/dm = -w^2.
  const KnotWeights force = scene.loaded.empty() ? KnotWeights{} : scene.force.at(t_next);
  const auto force_impulse = [&](int n) {
    return eta * at_knots(force, in.of(Quantity::force), static_cast<int>(scene.loaded.size()), scene.loaded_slot[n]);
  };
  for (const int n : scene.loaded) {
    if (!scene.inertial[n]) continue;
    const Vec3<T> v_star_bar = eta * Vec3<T>(q_bar.of(n));
    pull_back_knots(force, (eta * w[n]) * v_star_bar, in_bar.of(Quantity::force), static_cast<int>(scene.loaded.size()),
                    scene.loaded_slot[n]);
    mass_bar[n] -= w[n] * w[n] * dot(force_impulse(n), v_star_bar);
  }
  if (!scene.has_drag) return;
  for (int n = 0; n < scene.nodes(); ++n) {
    if (!scene.inertial[n]) continue;
    const int dof = scene.first_dof[n];
    const T m = in.of(Quantity::mass)[n];
    const Vec3<T> v_star_bar = eta * Vec3<T>(q_bar.of(n));
    const Vec3<T> free_velocity = history(bdf, Exactly<T>{}, s.v + dof, s.v_before + dof) + eta * gravity;
    const T along_velocity = dot(free_velocity, v_star_bar);
    mass_bar[n] += w[n] * (T(1.0) - weights.kept[n]) * along_velocity;
    T momentum_bar = m * along_velocity;
    if (scene.loaded_slot[n] >= 0) momentum_bar += dot(force_impulse(n), v_star_bar);
    const T m_eff_bar = -(w[n] * w[n] * (w_bar.of(n) + momentum_bar));
    const Vec3<T> v = extrapolated(bdf, s.v + dof, s.v_before + dof);
    const T v2 = dot(v, v), speed = sqrt_or_zero(v2);
    in_bar.of(Quantity::drag_linear)[n] += eta * m_eff_bar;
    in_bar.of(Quantity::drag_quadratic)[n] += eta * speed * m_eff_bar;
    const T along = eta * in.of(Quantity::drag_quadratic)[n] * m_eff_bar * inverse_or_zero(speed);
    pull_back_extrapolated(bdf, along * v, bar.v + dof, bar.v_before + dof);
  }
}

}  // namespace sheetbend
