// The reverse of ComputeEffectiveMasses: d(m w)/dm = w^2 eta c, dw/dm = -w^2.
#pragma once

#include "adjoint/step/stages.h"
#include "core/step/effective_masses.h"

namespace sheetbend {

template <>
struct ReverseOf<ComputeEffectiveMasses> {
  // Cotangents of what the stage computes.
  template <class T>
  struct Scratch {
    std::vector<T> w, kept, w_of_forces;

    void resize(const Scene& scene, const Plan&) {
      w.resize(scene.nodes());
      if (scene.has_drag) kept.resize(scene.nodes());
      w_of_forces.resize(scene.loaded.size());
    }
    static std::size_t bytes(const Scene& scene, const Plan&) {
      return sizeof(T) * ((scene.has_drag ? 2 : 1) * static_cast<std::size_t>(scene.nodes()) + scene.loaded.size());
    }
  };

  template <class T>
  static void run(const Step<T>& step, const Work<T>& work, InverseMasses<T>&, Scratch<T>&,
                  const StepCotangents<T>& bar) {
    const Scene& scene = step.scene;
    const T* w = work.masses.w.data();
    T* mass_bar = bar.in.of(Quantity::mass);
    const char* inertial = scene.inertial.data();
    const T* w_bar = bar.w;
    parallel_for(scene.nodes(), step.threads(), points_per_thread, [=](int begin, int end) {
      for (int n = begin; n < end; ++n)
        if (inertial[n]) mass_bar[n] -= w[n] * w[n] * w_bar[n];
    });
    const T eta(step.bdf.eta);
    for (const Director& d : scene.directors)
      if (scene.role[d.node] == Role::free) mass_bar[d.node] -= w[d.node] * w[d.node] * eta * eta * w_bar[d.node];
    for (std::size_t i = 0; i < scene.loaded.size(); ++i) {
      const int n = scene.loaded[i];
      if (inertial[n]) mass_bar[n] -= w[n] * w[n] * bar.w_of_forces[i];
    }
    if (scene.has_drag) drag(step, work.masses, bar);
  }

 private:
  template <class T>
  static void drag(const Step<T>& step, const InverseMasses<T>& masses, const StepCotangents<T>& bar) {
    const Scene& scene = step.scene;
    const std::vector<T>& w = masses.w;
    const T eta(step.bdf.eta);
    Vec3<T> wind_bar;
    for (int n = 0; n < scene.nodes(); ++n) {
      if (!scene.inertial[n]) continue;
      const int dof = scene.first_dof[n], slot = scene.loaded_slot[n];
      bar.in.of(Quantity::mass)[n] += w[n] * (T(1.0) - masses.kept[n]) * bar.kept[n];
      T momentum_bar = step.in.of(Quantity::mass)[n] * bar.kept[n];
      if (slot >= 0) momentum_bar += bar.w_of_forces[slot];
      const T m_eff_bar = -(w[n] * w[n] * (bar.w[n] + momentum_bar));
      Vec3<T> v = extrapolated(step.bdf, step.from.v + dof, step.from.v_before + dof);
      if (scene.has_weight[n]) v = v - masses.wind;
      const T v2 = dot(v, v), speed = sqrt_or_zero(v2);
      bar.in.of(Quantity::drag_linear)[n] += eta * m_eff_bar;
      bar.in.of(Quantity::drag_quadratic)[n] += eta * speed * m_eff_bar;
      const T along = eta * step.in.of(Quantity::drag_quadratic)[n] * m_eff_bar * inverse_or_zero(speed);
      pull_back_extrapolated(step.bdf, along * v, bar.from.v + dof, bar.from.v_before + dof);
      if (scene.has_weight[n]) wind_bar = wind_bar - along * v;
    }
    if (scene.drag_in_wind) pull_back_knots(scene.wind.at(step.t_next), wind_bar, bar.in.of(Quantity::wind), 1, 0);
  }
};

}  // namespace sheetbend
