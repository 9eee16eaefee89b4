// Bodies that keep their spin. The velocity read off positions loses angular momentum where a body turns by much in a substep, so the angular momentum about
// the center is a state of its own, L, and the axes' velocities are turned until they have it (in particles: Abderezaei 2026):
//
//   L* = history(L) + (1/eta) sum_k a_k x F_k,                 F_k: J^T lambda of all constraints but `rigid`, and eta^2 times loads and drag, on axis k
//   dw = I(a)^-1 (L* - sum_k J_k a_k x v_k),   v_k += dw x a_k,      I(a) = sum_k J_k (|a_k|^2 1 - a_k a_k^T)
//
// at the state that the substep has found. L stands in the coordinates of a pinned node, so that tape and restarts have it; what it is at the start follows
// from the velocities there.
#pragma once

#include "core/constraints/any_kind.h"
#include "core/step/apply_forces.h"
#include "core/step/apply_loads.h"
#include "core/step/stages.h"

namespace sheetbend {

// The angular momentum that velocities v (dofs) at x (dofs) have, and the inertia of a body.
template <class T>
struct Spin {
  Vec3<T> a[3], v[3], momentum, inertia[3];  // inertia: of the columns of I(a)
  T J[3];

  Spin(const Scene& scene, const Body& body, const T* mass, const T* x, const T* velocity) {
    const T zero(0.0);
    momentum = inertia[0] = inertia[1] = inertia[2] = Vec3<T>(zero, zero, zero);
    T size(0.0);
    for (int k = 0; k < 3; ++k) {
      const int dof = scene.first_dof[body.axes[k]];
      a[k] = Vec3<T>(x + dof), v[k] = Vec3<T>(velocity + dof), J[k] = mass[body.axes[k]];
      momentum = momentum + J[k] * cross(a[k], v[k]);
      size += J[k] * dot(a[k], a[k]);
      const Vec3<T> scaled_ = J[k] * a[k];
      inertia[0] = inertia[0] - a[k].x * scaled_;
      inertia[1] = inertia[1] - a[k].y * scaled_;
      inertia[2] = inertia[2] - a[k].z * scaled_;
    }
    inertia[0].x += size, inertia[1].y += size, inertia[2].z += size;
  }

  // I^-1 b, by Cramer's rule.
  Vec3<T> solve(const Vec3<T>& b) const {
    const Vec3<T> first = cross(inertia[1], inertia[2]), second = cross(inertia[2], inertia[0]),
                  third = cross(inertia[0], inertia[1]);
    return (T(1.0) / dot(inertia[0], first)) * Vec3<T>(dot(first, b), dot(second, b), dot(third, b));
  }
};

// Turns the axes' velocities v (dofs) until bodies have the spin that stands in x (dofs).
template <class T>
void turn_velocities(const Scene& scene, const T* mass, const T* x, T* v) {
  for (const Body& body : scene.bodies) {
    if (body.spin < 0) continue;
    const Spin<T> s(scene, body, mass, x, v);
    const Vec3<T> dw = s.solve(Vec3<T>(x + scene.first_dof[body.spin]) - s.momentum);
    for (int k = 0; k < 3; ++k) (s.v[k] + cross(dw, s.a[k])).store(v + scene.first_dof[body.axes[k]]);
  }
}

// L at the start.
template <class T>
void start_spins(const Scene& scene, const T* mass, T* x, const T* v) {
  for (const Body& body : scene.bodies)
    if (body.spin >= 0) Spin<T>(scene, body, mass, x, v).momentum.store(x + scene.first_dof[body.spin]);
}

// C and J of a constraint that turns bodies which keep their spin, at x (dofs).
template <class T>
void evaluate_turning(const Step<T>& step, const Turning& turning, const T* x, AnyConstraint<T>& at) {
  const Group& group = step.scene.groups[turning.group];
  const auto nodes = group.nodes(turning.item);
  for (int k = 0; k < group.arity; ++k) std::copy_n(x + step.scene.first_dof[nodes[k]], 3, at.x + 3 * k);
  at.evaluate(group.kind, step.in.of(Quantity::rest) + group.first_value +
                              static_cast<std::size_t>(turning.item) * group.parameters);
}

struct KeepSpin {
  static constexpr bool repeated = false;

  template <class T>
  struct Record {
    std::vector<T> multipliers;  // of the substep
    std::vector<Vec3<T>> push;   // F, per node that is an axis

    void resize(const Scene& scene, const Plan&, bool) {
      if (!scene.keeps_spin) return;
      multipliers.resize(scene.multipliers());
      push.resize(scene.nodes());
    }
    static std::size_t bytes(const Scene& scene, const Plan&, bool) {
      return scene.keeps_spin ? sizeof(T) * scene.multipliers() + sizeof(Vec3<T>) * scene.nodes() : 0;
    }
  };

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Record<T>& record) {
    const Scene& scene = step.scene;
    if (!scene.keeps_spin) return;
    add_pushes(step, work.masses, work.x_next, work.v_next, record);
    for (const Body& body : scene.bodies)
      if (body.spin >= 0) momentum(step, body, work.x_next, record).store(work.x_next + scene.first_dof[body.spin]);
    turn_velocities(scene, step.in.of(Quantity::mass), work.x_next, work.v_next);
  }

  // L*.
  template <class T>
  static Vec3<T> momentum(const Step<T>& step, const Body& body, const T* x, const Record<T>& record) {
    const int dof = step.scene.first_dof[body.spin];
    Vec3<T> turn(T(0.0), T(0.0), T(0.0));
    for (const int n : body.axes) turn = turn + cross(Vec3<T>(x + step.scene.first_dof[n]), record.push[n]);
    return history(step.bdf, Exactly<T>{}, step.from.x + dof, step.from.x_before + dof) + T(1.0 / step.bdf.eta) * turn;
  }

  // F at x with the velocities v, as they were read off positions.
  template <class T>
  static void add_pushes(const Step<T>& step, const InverseMasses<T>& masses, const T* x, const T* v,
                         Record<T>& record) {
    const Scene& scene = step.scene;
    const T eta(step.bdf.eta), one(1.0);
    const T* mass = step.in.of(Quantity::mass);
    std::fill(record.push.begin(), record.push.end(), Vec3<T>(T(0.0), T(0.0), T(0.0)));
    AnyConstraint<T> at;
    for (const Turning& turning : scene.turning) {
      const Group& group = scene.groups[turning.group];
      const auto nodes = group.nodes(turning.item);
      evaluate_turning(step, turning, x, at);
      at.set_push(record.multipliers.data() + group.first_row + turning.item * group.rows);
      for (int k = 0; k < group.arity; ++k) record.push[nodes[k]] = record.push[nodes[k]] + Vec3<T>(at.push + 3 * k);
    }
    if (!scene.loads.empty())
      RowLoads<T>(step).for_each_push([&](int n, const Vec3<T>& push) { record.push[n] = record.push[n] + push; });
    for (const Body& body : scene.bodies) {
      if (body.spin < 0) continue;
      for (const int n : body.axes) {
        if (const int slot = scene.loaded_slot[n]; slot >= 0)
          record.push[n] = record.push[n] + eta * ForceImpulses<T>(step).of(slot);
        if (scene.has_drag)
          record.push[n] = record.push[n] - (eta * (one / masses.w[n] - mass[n])) * Vec3<T>(v + scene.first_dof[n]);
      }
    }
  }
};

}  // namespace sheetbend
