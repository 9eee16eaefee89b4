// The reverse of ApplyLoads: with z_i the cotangents of the pushes eta^2 tau J_row on the stencil, tau_bar = eta^2 J_row . z, and eta^2 tau Hess(C_row) z goes to the
// positions that the row was taken at.
#pragma once

#include "adjoint/element/any_kind_vjp.h"
#include "adjoint/step/stages.h"
#include "core/step/apply_loads.h"

namespace sheetbend {

// z(node): the cotangent of the push on a node.
template <class T, class Z>
void row_loads_vjp(const Step<T>& step, Z&& z, const StateCotangents<T>& from, const Inputs<T>& in_bar) {
  const RowLoads<T> loads(step);
  const T eta2(step.bdf.eta * step.bdf.eta);
  AnyConstraint<T> at;
  T own[largest_kind.dofs], x_bar[largest_kind.dofs], chosen[largest_kind.rows], none[largest_kind.rows];
  for (T& a : none) a = T(0.0);
  for (std::size_t i = 0; i < step.scene.loads.size(); ++i) {
    const Load& load = step.scene.loads[i];
    const Group& group = step.scene.groups[load.group];
    const auto nodes = group.nodes(load.item);
    const T size = eta2 * loads.at(i);
    loads.evaluate(i, at);
    for (T& a : x_bar) a = T(0.0);
    for (int j = 0; j < group.rows; ++j) chosen[j] = T(j == load.row ? 1.0 : 0.0);
    T sum(0.0);
    for (int k = 0; k < group.arity; ++k) {
      const Vec3<T> of_node = z(nodes[k]);
      sum += dot(Vec3<T>(at.J + 3 * (load.row * group.arity + k)), of_node);
      (size * of_node).store(own + 3 * k);
    }
    pushes_vjp(group.kind, at.x, loads.parameters(i), chosen, none, own, x_bar,
               in_bar.of(Quantity::rest) + loads.first_parameter(i));
    for (int k = 0; k < group.arity; ++k) {
      const int dof = step.scene.first_dof[nodes[k]];
      pull_back_extrapolated(step.bdf, Vec3<T>(x_bar + 3 * k), from.x + dof, from.x_before + dof);
    }
    T* values_bar = in_bar.of(Quantity::load) + loads.knots.first * step.scene.loads.size() + i;
    for (int k = 0; k < loads.knots.count; ++k)
      values_bar[k * step.scene.loads.size()] += T(loads.knots.weight[k]) * (eta2 * sum);
  }
}

template <>
struct ReverseOf<ApplyLoads> {
  template <class T>
  using Scratch = Nothing;

  template <class T>
  static void run(const Step<T>& step, const Work<T>& work, Nothing&, Nothing&, const StepCotangents<T>& bar) {
    const Scene& scene = step.scene;
    if (scene.loads.empty()) return;
    RowLoads<T>(step).for_each_push([&](int n, const Vec3<T>& push) {
      if (scene.inertial[n]) bar.w[n] += dot(push, Vec3<T>(bar.q.of(n)));
    });
    const Vec3<T> none(T(0.0), T(0.0), T(0.0));
    row_loads_vjp(
        step, [&](int n) { return scene.inertial[n] ? work.masses.w[n] * Vec3<T>(bar.q.of(n)) : none; }, bar.from,
        bar.in);
  }
};

}  // namespace sheetbend
