// Air on triangles. The relative velocity u = wind - the triangle's own is split into u_n along the unit normal and u_t across it; with area A
//
//   f = A (k_n |u_n| u_n + k_t |u_t| u_t + p n),   k = air density * drag coefficient / 2  [kg/m^3],
//
// a third to each vertex. Which side the normal n points to matters to the pressure p alone: it pushes along (x1 - x0) x (x2 - x0).
#pragma once

#include "core/scene/wind.h"
#include "core/step/stages.h"

namespace sheetbend {

template <class T>
struct AirTriangle {
  Vec3<T> e1, e2, u;     // edges, relative velocity of the air
  T normal, tangential;  // k_n, k_t
  T pressure;
};

// With N = e1 x e2, |N| = 2 A, the force is a sum over N and u_t in which no speed is divided by.
template <class T>
struct AirForce {
  Vec3<T> N, u_t;
  T N_size, N2_inverse, u_N, u_N_size, u_t_size;  // u_N: u . N
  T along_N, along_u_t;                           // f = k_n along_N N + k_t along_u_t u_t
  Vec3<T> f;

  explicit AirForce(const AirTriangle<T>& at) : N(cross(at.e1, at.e2)) {
    const T N2 = dot(N, N);
    N_size = sqrt_or_zero(N2);
    N2_inverse = inverse_or_zero(N2);
    u_N = dot(at.u, N);
    u_N_size = select(u_N > T(0.0), u_N, -u_N);
    u_t = at.u - (u_N * N2_inverse) * N;
    u_t_size = sqrt_or_zero(dot(u_t, u_t));
    along_N = T(0.5) * u_N_size * u_N * N2_inverse;
    along_u_t = T(0.5) * N_size * u_t_size;
    f = (at.normal * along_N + T(0.5) * at.pressure) * N + (at.tangential * along_u_t) * u_t;
  }
};

// What the air meets in a substep: positions and velocities extrapolated to n+1, and the wind then. Both err by O(h^2), so the force does and
// BDF2 keeps its order; taken at n, or at the history of x, it would be first order.
template <class T>
struct Airflow {
  const Step<T>& step;
  Vec3<T> wind;

  explicit Airflow(const Step<T>& step_) : step(step_), wind(wind_at(step_.scene, step_.in, step_.t_next)) {}

  AirTriangle<T> at(int triangle) const {
    const SubstepStates<T>& s = step.from;
    Vec3<T> x[3], v[3];
    for (int k = 0; k < 3; ++k) {
      const int dof = step.scene.first_dof[step.scene.air[triangle][k]];
      x[k] = extrapolated(step.bdf, s.x + dof, s.x_before + dof);
      v[k] = extrapolated(step.bdf, s.v + dof, s.v_before + dof);
    }
    return {x[1] - x[0],
            x[2] - x[0],
            wind - T(1.0 / 3.0) * (v[0] + v[1] + v[2]),
            step.in.of(Quantity::air_normal)[triangle],
            step.in.of(Quantity::air_tangential)[triangle],
            step.in.of(Quantity::pressure)[triangle]};
  }
};

// Adds the air's w eta f to the predicted velocities, so eta times that to the predicted coordinates. One thread works, so bits do not depend
// on their number.
struct ApplyAirForces {
  static constexpr bool repeated = true;
  template <class T>
  using Record = Nothing;

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Nothing&) {
    const Scene& scene = step.scene;
    if (scene.air.empty()) return;
    const Airflow<T> air(step);
    const T eta(step.bdf.eta), share(step.bdf.eta / 3.0);
    for (int i = 0; i < static_cast<int>(scene.air.size()); ++i) {
      const Vec3<T> impulse = share * AirForce<T>(air.at(i)).f;
      for (const int n : scene.air[i])
        if (scene.inertial[n]) (eta * (work.masses.w[n] * impulse)).add_to(work.q.of(n));
    }
  }
};

}  // namespace sheetbend
