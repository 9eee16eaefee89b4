// The equations of static equilibrium, over any scalar. Unknowns are the coordinates x of the free nodes and the multipliers lambda:
//
//   r_x = f + J(x)^T lambda = 0        f = m gravity + force + drag in the wind, at the time t0, + pressure(x)
//   r_l = C(x) + alpha lambda = 0      alpha: compliance; 0 is a rigid constraint
//
// Multipliers are those of the constraints, then one per kept volume (C = V - V0), which is the pressure inside.
//
// J^T lambda is the force of the constraints on the particles, so a stretched link (C = length - rest > 0) has lambda = -tension.
// For an elastic constraint lambda = -C/alpha, and the pair is the stationarity of the energy -f.x + C.C/(2 alpha), with -p V for
// pressure (pressure.h).
// What contacts add to r_x stands in resting.h. Pinned nodes stay at Quantity::position, driven ones on their boundary at t0; damping and still air do not act at rest.
#pragma once

#include <algorithm>

#include "core/constraints/any_kind.h"
#include "core/equilibrium/pressure.h"
#include "core/scene/wind.h"
#include "core/step/substep.h"

namespace sheetbend {

// Calls f(group, item) for every constraint, in the scene's order.
template <class F>
void for_each_constraint(const Scene& scene, F&& f) {
  for (const Group& group : scene.groups)
    for (int i = 0; i < group.count; ++i) f(group, i);
}

template <class T>
const T* rest_parameters(const Inputs<const T>& in, const Group& group, int item) {
  return in.of(Quantity::rest) + group.first_value + static_cast<std::size_t>(item) * group.parameters;
}

// Copies a per-dof vector to the constraint's stencil.
template <class T>
void gather(const Scene& scene, const Group& group, int item, const T* from, T* local) {
  const auto nodes = group.nodes(item);
  for (int k = 0; k < group.arity; ++k) std::copy_n(from + scene.first_dof[nodes[k]], 3, local + 3 * k);
}

// C and J of a constraint at x (dofs).
template <class T>
void evaluate(const Scene& scene, const Inputs<const T>& in, const Group& group, int item, const T* x,
              AnyConstraint<T>& at) {
  gather(scene, group, item, x, at.x);
  at.evaluate(group.kind, rest_parameters(in, group, item));
}

// Writes the coordinates of pinned and driven nodes.
template <class T>
void place_fixed(const Scene& scene, const Inputs<const T>& in, double t0, T* x) {
  const KnotWeights boundary = scene.driven.empty() ? KnotWeights{} : scene.boundary.at(t0);
  for (int n = 0; n < scene.nodes(); ++n) {
    T* to = x + scene.first_dof[n];
    if (scene.role[n] == Role::pinned) std::copy_n(in.of(Quantity::position) + scene.first_dof[n], 3, to);
    if (scene.role[n] == Role::driven)
      at_knots(boundary, in.of(Quantity::boundary), static_cast<int>(scene.driven.size()), scene.driven_slot[n])
          .store(to);
  }
}

// What of f does not depend on x, zero on fixed nodes.
template <class T>
void dead_load(const Scene& scene, const Inputs<const T>& in, double t0, T* f) {
  const Vec3<T> gravity(in.of(Quantity::gravity));
  const Vec3<T> wind = wind_at(scene, in, t0);
  const KnotWeights knots = scene.loaded.empty() ? KnotWeights{} : scene.force.at(t0);
  std::fill_n(f, scene.dofs(), T(0.0));
  for (int n = 0; n < scene.nodes(); ++n) {
    if (!scene.inertial[n]) continue;
    if (scene.has_weight[n]) {
      (in.of(Quantity::mass)[n] * gravity).store(f + scene.first_dof[n]);
      if (scene.drag_in_wind) drag_force(in, n, wind).add_to(f + scene.first_dof[n]);
    }
    if (scene.loaded_slot[n] >= 0)
      at_knots(knots, in.of(Quantity::force), static_cast<int>(scene.loaded.size()), scene.loaded_slot[n])
          .add_to(f + scene.first_dof[n]);
  }
}

// f of the free nodes, zero on the others.
template <class T>
void external_force(const Scene& scene, const Inputs<const T>& in, double t0, const T* x, T* f) {
  dead_load(scene, in, t0, f);
  add_pressure_forces(scene, in, x, f);
}

// Compliances of all constraints, then of the kept volumes.
inline std::vector<double> compliances(const Scene& scene, const Inputs<const double>& in) {
  const double *own = in.of(Quantity::compliance), *volumes = in.of(Quantity::volume_compliance);
  std::vector<double> alpha(own, own + scene.constraints);
  alpha.insert(alpha.end(), volumes, volumes + scene.volumes.size());
  return alpha;
}

// The volume's C, and its gradient with respect to the volume's nodes.
template <class T>
T kept_volume(const Scene& scene, const Inputs<const T>& in, int i, const T* x, std::vector<Vec3<T>>& gradient) {
  const Volume& volume = scene.volumes[i];
  std::vector<Vec3<T>> at(volume.nodes.size());
  place_volume([&](std::size_t k) { return Vec3<T>(x + scene.first_dof[volume.nodes[k]]); }, at);
  gradient.resize(at.size());
  return enclosed(volume, at, gradient) - in.of(Quantity::volume)[i];
}

// r_x (dofs, zero on fixed nodes) and r_l (multipliers) at x (dofs, with the fixed nodes placed) and lambda (multipliers).
template <class T>
void equilibrium_residual(const Scene& scene, const Inputs<const T>& in, double t0, const T* x, const T* lambda, T* r_x,
                          T* r_l) {
  external_force(scene, in, t0, x, r_x);
  AnyConstraint<T> own;
  for_each_constraint(scene, [&](const Group& group, int item) {
    const int row = group.first_row + item * group.rows;
    const T& alpha = in.of(Quantity::compliance)[group.first + item];
    evaluate(scene, in, group, item, x, own);
    for (int j = 0; j < group.rows; ++j) r_l[row + j] = own.C[j] + alpha * lambda[row + j];
    own.set_push(lambda + row);
    const auto nodes = group.nodes(item);
    for (int k = 0; k < group.arity; ++k)
      if (scene.role[nodes[k]] == Role::free) Vec3<T>(own.push + 3 * k).add_to(r_x + scene.first_dof[nodes[k]]);
  });
  std::vector<Vec3<T>> gradient;
  for (int i = 0; i < static_cast<int>(scene.volumes.size()); ++i) {
    const std::vector<int>& nodes = scene.volumes[i].nodes;
    const T& p = lambda[scene.rows + i];
    r_l[scene.rows + i] = kept_volume(scene, in, i, x, gradient) + in.of(Quantity::volume_compliance)[i] * p;
    for (std::size_t k = 0; k < nodes.size(); ++k)
      if (scene.role[nodes[k]] == Role::free) (p * gradient[k]).add_to(r_x + scene.first_dof[nodes[k]]);
  }
}

}  // namespace sheetbend
