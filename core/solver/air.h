// Air on triangles. What blows at one, u = wind - its own velocity, parts into u_n along the unit normal and u_t across it; with area A
//
//   f = A (k_n |u_n| u_n + k_t |u_t| u_t + p n),   k = air density * drag coefficient / 2  [kg/m^3],
//
// a third to each vertex. Which side the normal n points to matters to the pressure p alone: it pushes along (x1 - x0) x (x2 - x0).
#pragma once

#include "core/solver/predict.h"

namespace sheetbend {

template <class T>
struct AirTriangle {
  Vec3<T> e1, e2, u;     // edges, what blows
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
  const Scene& scene;
  const Inputs<const T>& in;
  const Bdf& bdf;
  const SubstepStates<T>& s;
  KnotWeights knots;
  Vec3<T> wind;

  Airflow(const Scene& scene_, const Inputs<const T>& in_, const Bdf& bdf_, double t_next, const SubstepStates<T>& s_)
      : scene(scene_),
        in(in_),
        bdf(bdf_),
        s(s_),
        knots(scene_.wind.at(t_next)),
        wind(at_knots(knots, in_.of(Quantity::wind), 1, 0)) {}

  AirTriangle<T> at(int triangle) const {
    Vec3<T> x[3], v[3];
    for (int k = 0; k < 3; ++k) {
      const int dof = scene.first_dof[scene.air[triangle][k]];
      x[k] = extrapolated(bdf, s.x + dof, s.x_before + dof);
      v[k] = extrapolated(bdf, s.v + dof, s.v_before + dof);
    }
    return {x[1] - x[0],
            x[2] - x[0],
            wind - T(1.0 / 3.0) * (v[0] + v[1] + v[2]),
            in.of(Quantity::air_normal)[triangle],
            in.of(Quantity::air_tangential)[triangle],
            in.of(Quantity::pressure)[triangle]};
  }
};

// Adds the air's w eta f to the predicted velocities, so eta times that to the predicted q. One thread works, so bits do not depend on
// their number.
template <class T>
void blow(const Scene& scene, const Inputs<const T>& in, const Bdf& bdf, double t_next, const SubstepStates<T>& s,
          const Weights<T>& weights, const Coordinates<T>& q) {
  if (scene.air.empty()) return;
  const Airflow<T> air(scene, in, bdf, t_next, s);
  const T eta(bdf.eta), share(bdf.eta / 3.0);
  for (int i = 0; i < static_cast<int>(scene.air.size()); ++i) {
    const Vec3<T> impulse = share * AirForce<T>(air.at(i)).f;
    for (const int n : scene.air[i])
      if (scene.inertial[n]) (eta * (weights.w[n] * impulse)).add_to(q.of(n));
  }
}

}  // namespace sheetbend
