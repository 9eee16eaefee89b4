// The reverse of the air's forces on triangles.
#pragma once

#include "adjoint/step/stages.h"
#include "core/step/apply_air_forces.h"

namespace sheetbend {

// Cotangents of a triangle from that of its force. Where a speed or the area is zero, so is the slope of the force along it.
template <class T>
AirTriangle<T> air_force_vjp(const AirTriangle<T>& at, const AirForce<T>& a, const Vec3<T>& f_bar) {
  AirTriangle<T> bar;
  const T f_N = dot(f_bar, a.N), f_t = dot(f_bar, a.u_t);
  bar.normal = a.along_N * f_N;
  bar.tangential = a.along_u_t * f_t;
  bar.pressure = T(0.5) * f_N;
  const T along_N_bar = at.normal * f_N, along_u_t_bar = at.tangential * f_t;
  const T u_t_size_bar = T(0.5) * a.N_size * along_u_t_bar;
  const Vec3<T> u_t_bar = (at.tangential * a.along_u_t) * f_bar + (u_t_size_bar * inverse_or_zero(a.u_t_size)) * a.u_t;
  // u_t = u - p N, p = u_N / N2
  const T p = a.u_N * a.N2_inverse, p_bar = -dot(u_t_bar, a.N);
  const T u_N_bar = a.N2_inverse * (a.u_N_size * along_N_bar + p_bar);
  const T N2_inverse_bar = a.u_N * (T(0.5) * a.u_N_size * along_N_bar + p_bar);
  const T N_size_bar = T(0.5) * a.u_t_size * along_u_t_bar;
  // |N| and 1/N2 by N
  const T along = N_size_bar * inverse_or_zero(a.N_size) - T(2.0) * a.N2_inverse * a.N2_inverse * N2_inverse_bar;
  const Vec3<T> N_bar =
      (at.normal * a.along_N + T(0.5) * at.pressure) * f_bar - p * u_t_bar + u_N_bar * at.u + along * a.N;
  bar.u = u_t_bar + u_N_bar * a.N;
  bar.e1 = cross(at.e2, N_bar);
  bar.e2 = cross(N_bar, at.e1);
  return bar;
}

template <>
struct ReverseOf<ApplyAirForces> {
  template <class T>
  using Scratch = Nothing;

  template <class T>
  static void run(const Step<T>& step, const Work<T>& work, Nothing&, Nothing&, const StepCotangents<T>& bar) {
    const Scene& scene = step.scene;
    if (scene.air.empty()) return;
    const Airflow<T> air(step);
    const KnotWeights wind_knots = scene.wind.at(step.t_next);
    const T eta(step.bdf.eta), share(step.bdf.eta / 3.0);
    for (int i = 0; i < static_cast<int>(scene.air.size()); ++i) {
      const AirTriangle<T> at = air.at(i);
      const AirForce<T> force(at);
      const Vec3<T> impulse = share * force.f;
      Vec3<T> impulse_bar;
      for (const int n : scene.air[i]) {
        if (!scene.inertial[n]) continue;
        const Vec3<T> v_star_bar = eta * Vec3<T>(bar.q.of(n));
        bar.w[n] += dot(impulse, v_star_bar);
        impulse_bar = impulse_bar + work.masses.w[n] * v_star_bar;
      }
      const AirTriangle<T> at_bar = air_force_vjp(at, force, share * impulse_bar);
      bar.in.of(Quantity::air_normal)[i] += at_bar.normal;
      bar.in.of(Quantity::air_tangential)[i] += at_bar.tangential;
      bar.in.of(Quantity::pressure)[i] += at_bar.pressure;
      pull_back_knots(wind_knots, at_bar.u, bar.in.of(Quantity::wind), 1, 0);
      const Vec3<T> v_bar = T(-1.0 / 3.0) * at_bar.u, x_bar[3] = {-(at_bar.e1 + at_bar.e2), at_bar.e1, at_bar.e2};
      for (int k = 0; k < 3; ++k) {
        const int dof = scene.first_dof[scene.air[i][k]];
        pull_back_extrapolated(step.bdf, x_bar[k], bar.from.x + dof, bar.from.x_before + dof);
        pull_back_extrapolated(step.bdf, v_bar, bar.from.v + dof, bar.from.v_before + dof);
      }
    }
  }
};

}  // namespace sheetbend
