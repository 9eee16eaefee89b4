// Loads along rows of constraints, given at knots: the force tau(t) J_row^T on the row's stencil, which is a torque about a hinge where the row is an angle, the
// tension of a thread or the thrust of a slider where it is a length. tau has the unit of energy over that of C. The force is explicit, at positions extrapolated to
// n+1 as the air's, so that BDF2 keeps its order; the row's own compliance may be as large as one likes.
#pragma once

#include "core/constraints/any_kind.h"
#include "core/step/stages.h"

namespace sheetbend {

// The loads that a substep meets at its end.
template <class T>
struct RowLoads {
  const Step<T>& step;
  KnotWeights knots;

  explicit RowLoads(const Step<T>& step_) : step(step_), knots(step_.scene.load.at(step_.t_next)) {}

  T at(std::size_t i) const {
    const T* values = step.in.of(Quantity::load) + knots.first * step.scene.loads.size() + i;
    T sum(0.0);
    for (int k = 0; k < knots.count; ++k) sum += T(knots.weight[k]) * values[k * step.scene.loads.size()];
    return sum;
  }

  // C and J of the constraint of load i, extrapolated.
  void evaluate(std::size_t i, AnyConstraint<T>& at) const {
    const Load& load = step.scene.loads[i];
    const Group& group = step.scene.groups[load.group];
    const auto nodes = group.nodes(load.item);
    for (int k = 0; k < group.arity; ++k) {
      const int dof = step.scene.first_dof[nodes[k]];
      extrapolated(step.bdf, step.from.x + dof, step.from.x_before + dof).store(at.x + 3 * k);
    }
    at.evaluate(group.kind, parameters(i));
  }
  const T* parameters(std::size_t i) const { return step.in.of(Quantity::rest) + first_parameter(i); }
  std::size_t first_parameter(std::size_t i) const {
    const Load& load = step.scene.loads[i];
    const Group& group = step.scene.groups[load.group];
    return group.first_value + static_cast<std::size_t>(load.item) * group.parameters;
  }

  // Calls f(node, eta^2 tau J_row) for the stencils of all loads, one after the other.
  template <class F>
  void for_each_push(F&& f) const {
    const double eta2 = step.bdf.eta * step.bdf.eta;
    AnyConstraint<T> own;
    for (std::size_t i = 0; i < step.scene.loads.size(); ++i) {
      const Load& load = step.scene.loads[i];
      const Group& group = step.scene.groups[load.group];
      const T size = T(eta2) * at(i);
      evaluate(i, own);
      for (int k = 0; k < group.arity; ++k)
        f(group.nodes(load.item)[k], size * Vec3<T>(own.J + 3 * (load.row * group.arity + k)));
    }
  }
};

struct ApplyLoads {
  static constexpr bool repeated = true;
  template <class T>
  using Record = Nothing;

  template <class T>
  static void forward(const Step<T>& step, Work<T>& work, Nothing&) {
    if (step.scene.loads.empty()) return;
    RowLoads<T>(step).for_each_push([&](int n, const Vec3<T>& push) {
      if (step.scene.inertial[n]) (work.masses.w[n] * push).add_to(work.q.of(n));
    });
  }
};

}  // namespace sheetbend
