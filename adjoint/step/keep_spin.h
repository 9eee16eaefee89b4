// The reverse of KeepSpin on the state that it found. With v'_bar and L*_bar coming in, w_bar = sum a_k x v'_bar_k and r = I^-1 w_bar,
//
//   L*_bar += r      v_bar_k = v'_bar_k - J_k r x a_k      F_bar_k = L*_bar x a_k/eta      J_bar_k = -(a_k x v_k).r - |a_k|^2 r.dw + (r.a_k)(a_k.dw)
//   a_bar_k = v'_bar_k x dw - J_k (v_k x r + 2 (r.dw) a_k - (a_k.dw) r - (a_k.r) dw) + F_k x L*_bar/eta,
//
// and F_bar goes on to the multipliers, as J F_bar, and through J to coordinates and parameters.
#pragma once

#include "adjoint/element/any_kind_vjp.h"
#include "adjoint/step/apply_loads.h"
#include "adjoint/step/stages.h"
#include "core/step/keep_spin.h"

namespace sheetbend {

template <class T>
void start_spins_vjp(const Scene& scene, const T* mass, const T* x, const T* v, T* x_bar, T* v_bar, T* mass_bar) {
  for (const Body& body : scene.bodies) {
    if (body.spin < 0) continue;
    T* spin_bar = x_bar + scene.first_dof[body.spin];
    const Vec3<T> L_bar(spin_bar);
    const Spin<T> s(scene, body, mass, x, v);
    for (int k = 0; k < 3; ++k) {
      const int n = body.axes[k], dof = scene.first_dof[n];
      mass_bar[n] += dot(cross(s.a[k], s.v[k]), L_bar);
      (s.J[k] * cross(s.v[k], L_bar)).add_to(x_bar + dof);
      (s.J[k] * cross(L_bar, s.a[k])).add_to(v_bar + dof);
    }
    std::fill_n(spin_bar, 3, T(0.0));
  }
}

template <>
struct ReverseOf<KeepSpin> {
  template <class T>
  struct Scratch {
    std::vector<T> x, v, multipliers;  // the state found; the multipliers' cotangents
    std::vector<Vec3<T>> push;         // cotangents of F

    void resize(const Scene& scene, const Plan&) {
      if (!scene.keeps_spin) return;
      for (auto* a : {&x, &v}) a->resize(scene.dofs());
      multipliers.resize(scene.multipliers());
      push.resize(scene.nodes());
    }
    static std::size_t bytes(const Scene& scene, const Plan&) {
      return scene.keeps_spin ? sizeof(T) * (2 * scene.dofs() + scene.multipliers()) + sizeof(Vec3<T>) * scene.nodes()
                              : 0;
    }
  };

  template <class T>
  static void run(const Step<T>& step, const Work<T>& work, KeepSpin::Record<T>& record, Scratch<T>& s,
                  const StepCotangents<T>& bar) {
    const Scene& scene = step.scene;
    if (!scene.keeps_spin) return;
    read_velocities(step, work, s);
    KeepSpin::add_pushes(step, work.masses, s.x.data(), s.v.data(), record);
    std::fill(s.push.begin(), s.push.end(), Vec3<T>(T(0.0), T(0.0), T(0.0)));
    for (const Body& body : scene.bodies)
      if (body.spin >= 0) turn_back(step, body, work.masses, record, s, bar);
    all_pushes_vjp(step, record, s, bar);
    if (!scene.loads.empty()) row_loads_vjp(step, [&](int n) { return s.push[n]; }, bar.from, bar.in);
  }

 private:
  // As UpdateVelocities did.
  template <class T>
  static void read_velocities(const Step<T>& step, const Work<T>& work, Scratch<T>& s) {
    const T rate(1.0 / step.bdf.eta);
    for (int n = 0; n < step.scene.nodes(); ++n) {
      const int dof = step.scene.first_dof[n];
      const Vec3<T> x(work.q.of(n));
      x.store(s.x.data() + dof);
      (rate * (x - history(step.bdf, Exactly<T>{}, step.from.x + dof, step.from.x_before + dof)))
          .store(s.v.data() + dof);
    }
  }

  template <class T>
  static void turn_back(const Step<T>& step, const Body& body, const InverseMasses<T>& masses,
                        const KeepSpin::Record<T>& record, Scratch<T>& s, const StepCotangents<T>& bar) {
    const Scene& scene = step.scene;
    const int spin_dof = scene.first_dof[body.spin];
    const T* mass = step.in.of(Quantity::mass);
    T* mass_bar = bar.in.of(Quantity::mass);
    const Spin<T> at(scene, body, mass, s.x.data(), s.v.data());
    const T eta(step.bdf.eta), rate(1.0 / step.bdf.eta), one(1.0), two(2.0);
    const Vec3<T> dw = at.solve(KeepSpin::momentum(step, body, s.x.data(), record) - at.momentum);
    Vec3<T> w_bar(T(0.0), T(0.0), T(0.0));
    for (int k = 0; k < 3; ++k) w_bar = w_bar + cross(at.a[k], Vec3<T>(bar.v_next + scene.first_dof[body.axes[k]]));
    const Vec3<T> r = at.solve(w_bar), L_bar = Vec3<T>(bar.x_next + spin_dof) + r;
    pull_back_history(step.bdf, Exactly<T>{}, L_bar, bar.from.x + spin_dof, bar.from.x_before + spin_dof);
    std::fill_n(bar.x_next + spin_dof, 3, T(0.0));
    for (int k = 0; k < 3; ++k) {
      const int n = body.axes[k], dof = scene.first_dof[n];
      const Vec3<T>&a = at.a[k], &v = at.v[k], next_bar(bar.v_next + dof), F_bar = rate * cross(L_bar, a);
      const T &J = at.J[k], along = dot(a, dw), across_ = dot(a, r), both = dot(r, dw);
      mass_bar[n] += across_ * along - dot(cross(a, v), r) - dot(a, a) * both;
      Vec3<T> a_bar = cross(next_bar, dw) - J * (cross(v, r) + (two * both) * a - along * r - across_ * dw);
      a_bar = a_bar + rate * cross(record.push[n], L_bar);
      Vec3<T> v_bar = -J * cross(r, a);  // beside v'_bar, which goes on by itself
      if (scene.has_drag) {
        const T lost = one / masses.w[n] - mass[n], of_drag = dot(v, F_bar);
        v_bar = v_bar - (eta * lost) * F_bar;
        bar.w[n] += (eta / (masses.w[n] * masses.w[n])) * of_drag;
        mass_bar[n] += eta * of_drag;
      }
      (a_bar + rate * v_bar).add_to(bar.x_next + dof);
      pull_back_history(step.bdf, Exactly<T>{}, -rate * v_bar, bar.from.x + dof, bar.from.x_before + dof);
      s.push[n] = F_bar;
      if (const int slot = scene.loaded_slot[n]; slot >= 0)
        pull_back_knots(scene.force.at(step.t_next), (eta * eta) * F_bar, bar.in.of(Quantity::force),
                        static_cast<int>(scene.loaded.size()), slot);
    }
  }

  // F = J^T lambda of the constraints.
  template <class T>
  static void all_pushes_vjp(const Step<T>& step, const KeepSpin::Record<T>& record, Scratch<T>& s,
                             const StepCotangents<T>& bar) {
    const Scene& scene = step.scene;
    std::fill(s.multipliers.begin(), s.multipliers.end(), T(0.0));
    AnyConstraint<T> at;
    T z[largest_kind.dofs], x_bar[largest_kind.dofs], none[largest_kind.rows];
    for (T& a : none) a = T(0.0);
    for (const Turning& turning : scene.turning) {
      const Group& group = scene.groups[turning.group];
      const auto nodes = group.nodes(turning.item);
      const std::size_t value = group.first_value + static_cast<std::size_t>(turning.item) * group.parameters;
      const int row = group.first_row + turning.item * group.rows, dofs = 3 * group.arity;
      for (int k = 0; k < group.arity; ++k) s.push[nodes[k]].store(z + 3 * k);
      for (T& a : x_bar) a = T(0.0);
      evaluate_turning(step, turning, s.x.data(), at);
      for (int j = 0; j < group.rows; ++j)
        for (int d = 0; d < dofs; ++d) s.multipliers[row + j] += at.J[j * dofs + d] * z[d];
      pushes_vjp(group.kind, at.x, step.in.of(Quantity::rest) + value, record.multipliers.data() + row, none, z, x_bar,
                 bar.in.of(Quantity::rest) + value);
      for (int k = 0; k < group.arity; ++k) Vec3<T>(x_bar + 3 * k).add_to(bar.x_next + scene.first_dof[nodes[k]]);
    }
  }
};

}  // namespace sheetbend
