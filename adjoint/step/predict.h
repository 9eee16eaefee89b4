// The reverse of Predict.
#pragma once

#include "adjoint/step/stages.h"
#include "core/step/predict.h"

namespace sheetbend {

template <>
struct ReverseOf<Predict> {
  template <class T>
  struct Scratch {
    std::vector<Vec3<T>> gravity;  // the sums of chunks

    // The sum for gravity goes by chunks of one size, whoever works on them.
    static constexpr int points_per_sum = 1024;
    static int chunks(const Scene& scene) { return (scene.nodes() + points_per_sum - 1) / points_per_sum; }

    void resize(const Scene& scene, const Plan&) { gravity.resize(chunks(scene)); }
    static std::size_t bytes(const Scene& scene, const Plan&) { return sizeof(Vec3<T>) * chunks(scene); }
  };

  template <class T>
  static void run(const Step<T>& step, const Work<T>& work, Nothing&, Scratch<T>& scratch,
                  const StepCotangents<T>& bar) {
    free_motion(step, work, scratch, bar);
    weightless_nodes(step, work, bar);
    fixed_nodes(step, bar);
    if (step.scene.has_drag) kept_momentum(step, work.masses, bar);
  }

 private:
  // q = history(x) + eta v*, v* = u + m w (history(v) - u + eta g)
  template <class T>
  static void free_motion(const Step<T>& step, const Work<T>& work, Scratch<T>& scratch,
                          const StepCotangents<T>& cotangents) {
    const Scene& scene = step.scene;
    const Bdf bdf = step.bdf;
    const T eta(bdf.eta);
    const T* kept = scene.has_drag ? work.masses.kept.data() : nullptr;
    const int *first_dof = scene.first_dof.data(), nodes = scene.nodes();
    const char* has_weight = scene.has_weight.data();
    const Coordinates<T> q_bar = cotangents.q;
    const StateCotangents<T> bar = cotangents.from;
    Vec3<T>* sums = scratch.gravity.data();
    constexpr int points_per_sum = Scratch<T>::points_per_sum;
    parallel_for(Scratch<T>::chunks(scene), step.threads(), 1, [=](int first, int last) {
      for (int chunk = first; chunk < last; ++chunk) {
        PointSum<T> sum;
        const int begin = chunk * points_per_sum, end = std::min(begin + points_per_sum, nodes);
        for_each_point<T>(begin, end, [=, &sum](int n, auto how) {
          if (!has_weight[n]) return;
          const int dof = first_dof[n];
          const auto x_bar = how.load(q_bar.of(n));
          auto v_bar = scaled(eta, x_bar);
          if (kept) v_bar = scaled(kept[n], v_bar);
          pull_back_history(bdf, how, x_bar, bar.x + dof, bar.x_before + dof);
          pull_back_history(bdf, how, v_bar, bar.v + dof, bar.v_before + dof);
          sum.add(scaled(eta, v_bar));
        });
        sums[chunk] = sum.total();
      }
    });
    for (const Vec3<T>& sum : scratch.gravity) sum.add_to(cotangents.in.of(Quantity::gravity));
  }

  template <class T>
  static void weightless_nodes(const Step<T>& step, const Work<T>& work, const StepCotangents<T>& bar) {
    const Scene& scene = step.scene;
    const Exactly<T> how;
    for (const int n : scene.axes) {
      const int dof = scene.first_dof[n];
      const Vec3<T> x_bar(bar.q.of(n));
      Vec3<T> v_bar = T(step.bdf.eta) * x_bar;
      if (scene.has_drag) v_bar = work.masses.kept[n] * v_bar;
      pull_back_history(step.bdf, how, x_bar, bar.from.x + dof, bar.from.x_before + dof);
      pull_back_history(step.bdf, how, v_bar, bar.from.v + dof, bar.from.v_before + dof);
    }
  }

  template <class T>
  static void fixed_nodes(const Step<T>& step, const StepCotangents<T>& bar) {
    const Scene& scene = step.scene;
    for (const Director& d : scene.directors) {
      if (scene.role[d.node] != Role::free) continue;
      const int dof = scene.first_dof[d.node];
      pull_back_extrapolated(step.bdf, Vec3<T>(bar.q.of(d.node)), bar.from.x + dof, bar.from.x_before + dof);
    }
    for (const int n : scene.pinned) Vec3<T>(bar.q.of(n)).add_to(bar.from.x + scene.first_dof[n]);
    if (scene.driven.empty()) return;
    const KnotWeights boundary = scene.boundary.at(step.t_next);
    const int slots = static_cast<int>(scene.driven.size());
    for (int i = 0; i < slots; ++i)
      pull_back_knots(boundary, Vec3<T>(bar.q.of(scene.driven[i])), bar.in.of(Quantity::boundary), slots, i);
  }

  // Of m w and of the wind u, with drag.
  template <class T>
  static void kept_momentum(const Step<T>& step, const InverseMasses<T>& masses, const StepCotangents<T>& bar) {
    const Scene& scene = step.scene;
    const T eta(step.bdf.eta);
    const Vec3<T> gravity(step.in.of(Quantity::gravity));
    Vec3<T> wind_bar;
    for (int n = 0; n < scene.nodes(); ++n) {
      if (!scene.inertial[n]) continue;
      const int dof = scene.first_dof[n];
      const Vec3<T> v_star_bar = eta * Vec3<T>(bar.q.of(n));
      Vec3<T> free_velocity = history(step.bdf, Exactly<T>{}, step.from.v + dof, step.from.v_before + dof);
      if (scene.has_weight[n]) {
        free_velocity = free_velocity + (eta * gravity - masses.wind);
        wind_bar = wind_bar + (T(1.0) - masses.kept[n]) * v_star_bar;
      }
      bar.kept[n] = dot(free_velocity, v_star_bar);
    }
    if (scene.drag_in_wind) pull_back_knots(scene.wind.at(step.t_next), wind_bar, bar.in.of(Quantity::wind), 1, 0);
  }
};

}  // namespace sheetbend
