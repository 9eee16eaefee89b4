#include "adjoint/equilibrium/equilibrium_vjp.h"

#include "adjoint/element/any_kind_vjp.h"
#include "adjoint/equilibrium/resting_vjp.h"
#include "adjoint/step/substep.h"

namespace sheetbend {

namespace {

// What the reverse of the balance goes through: the state of rest, the solution u (of coordinates) and v (of multipliers) of the transposed system, and
// the cotangents of the coordinates of nodes that are held, and of the inputs.
struct Balance {
  const Scene& scene;
  const Inputs<const double>& in;
  const Equilibrium& at;
  const std::vector<double>&u, &v;
  std::vector<double>& fixed;
  const Inputs<double>& bar;
};

void pull_back_elements(const Balance& r) {
  AnyConstraint<double> own;
  for_each_constraint(r.scene, [&](const Group& group, int item) {
    const int first_row = group.first_row + item * group.rows, dofs = 3 * group.arity;
    double away[largest_kind.dofs], by[largest_kind.dofs]{};
    evaluate(r.scene, r.in, group, item, r.at.x.data(), own);
    gather(r.scene, group, item, r.u.data(), away);
    for (int d = 0; d < dofs; ++d) away[d] = -away[d];
    const double* p = rest_parameters(r.in, group, item);
    double* p_bar = r.bar.of(Quantity::rest) + (p - r.in.of(Quantity::rest));
    pushes_vjp(group.kind, own.x, p, &r.at.lambda[first_row], &r.v[first_row], away, by, p_bar);
    for (int j = 0; j < group.rows; ++j) {
      r.bar.of(Quantity::compliance)[group.first + item] -= r.v[first_row + j] * r.at.lambda[first_row + j];
      for (int d = 0; d < dofs; ++d) by[d] -= r.v[first_row + j] * own.J[j * dofs + d];
    }
    for (int d = 0; d < dofs; ++d) r.fixed[r.scene.first_dof[group.nodes(item)[d / 3]] + d % 3] += by[d];
  });
}

void pull_back_pressure(const Balance& r) {
  for_each_pressed(r.scene, r.in, [&](int i, const std::array<int, 3>& nodes, double p) {
    Vec3<double> pushed;
    for (const int n : nodes)
      if (r.scene.inertial[n]) pushed = pushed + Vec3<double>(&r.u[r.scene.first_dof[n]]);
    const auto [a, b, c] = corners_at<double>(r.scene, nodes, r.at.x.data());
    r.bar.of(Quantity::pressure)[i] -= dot(pushed, cross(b - a, c - a)) / 6.0;
    const Vec3<double> N_bar = -p / 6.0 * pushed, b_bar = cross(c - a, N_bar), c_bar = cross(N_bar, b - a);
    (-(b_bar + c_bar)).add_to(&r.fixed[r.scene.first_dof[nodes[0]]]);
    b_bar.add_to(&r.fixed[r.scene.first_dof[nodes[1]]]);
    c_bar.add_to(&r.fixed[r.scene.first_dof[nodes[2]]]);
  });
}

void pull_back_kept_volumes(const Balance& r) {
  std::vector<Vec3<double>> x, along, gradient;
  for (int i = 0; i < static_cast<int>(r.scene.volumes.size()); ++i) {
    const Volume& volume = r.scene.volumes[i];
    const double p = r.at.lambda[r.scene.rows + i], v_here = r.v[r.scene.rows + i];
    const auto dof = [&](std::size_t k) { return r.scene.first_dof[volume.nodes[k]]; };
    for (auto* a : {&x, &along, &gradient}) a->resize(volume.nodes.size());
    place_volume([&](std::size_t k) { return Vec3<double>(&r.at.x[dof(k)]); }, x);
    enclosed(volume, x, gradient);
    for (std::size_t k = 0; k < x.size(); ++k) {
      along[k] = -p * Vec3<double>(&r.u[dof(k)]);
      (-v_here * gradient[k]).add_to(&r.fixed[dof(k)]);
    }
    for_each_hessian_times(volume, x, along, [&](int k, const Vec3<double>& share) { share.add_to(&r.fixed[dof(k)]); });
    r.bar.of(Quantity::volume)[i] += v_here;
    r.bar.of(Quantity::volume_compliance)[i] -= v_here * p;
  }
}

void pull_back_resting(const Balance& r) {
  std::vector<double> away(r.u.size());
  for (std::size_t i = 0; i < r.u.size(); ++i) away[i] = -r.u[i];
  std::vector<double> given(r.at.held.size());
  const RestingContacts<double> contacts(r.scene, r.in, r.at.t0,
                                         given.empty() ? r.in.of(Quantity::position) : r.at.held.data());
  resting_vjp(contacts, r.at.x.data(), away.data(), given.empty() ? r.bar.of(Quantity::position) : given.data(), r.bar);
}

// Of the drag of a node at rest in the wind u, f = (c1 + c2 |u|) u.
void pull_back_drag(const Balance& r, int n, const Vec3<double>& u, const Vec3<double>& f_bar, Vec3<double>& u_bar) {
  const double along = dot(f_bar, u), speed = norm(u), quadratic = r.in.of(Quantity::drag_quadratic)[n];
  r.bar.of(Quantity::drag_linear)[n] += along;
  r.bar.of(Quantity::drag_quadratic)[n] += speed * along;
  u_bar = u_bar + (r.in.of(Quantity::drag_linear)[n] + quadratic * speed) * f_bar +
          (quadratic * along * inverse_or_zero(speed)) * u;
}

// Places of nodes that are held, masses, gravity, drag in the wind and forces.
void pull_back_held_and_loads(const Balance& r) {
  const Vec3<double> gravity(r.in.of(Quantity::gravity));
  const KnotWeights boundary = r.scene.driven.empty() ? KnotWeights{} : r.scene.boundary.at(r.at.t0);
  const Vec3<double> wind = wind_at(r.scene, r.in, r.at.t0);
  Vec3<double> wind_bar;
  const KnotWeights force = r.scene.loaded.empty() ? KnotWeights{} : r.scene.force.at(r.at.t0);
  for (int n = 0; n < r.scene.nodes(); ++n) {
    const Vec3<double> un(&r.u[r.scene.first_dof[n]]), held(&r.fixed[r.scene.first_dof[n]]);
    if (r.scene.role[n] == Role::pinned) {
      held.add_to(r.bar.of(Quantity::position) + r.scene.first_dof[n]);
    } else if (r.scene.role[n] == Role::driven) {
      pull_back_knots(boundary, held, r.bar.of(Quantity::boundary), static_cast<int>(r.scene.driven.size()),
                      r.scene.driven_slot[n]);
    } else if (r.scene.inertial[n]) {
      if (r.scene.has_weight[n]) {
        r.bar.of(Quantity::mass)[n] -= dot(un, gravity);
        (-r.in.of(Quantity::mass)[n] * un).add_to(r.bar.of(Quantity::gravity));
        if (r.scene.drag_in_wind) pull_back_drag(r, n, wind, -un, wind_bar);
      }
      if (r.scene.loaded_slot[n] >= 0)
        pull_back_knots(force, -un, r.bar.of(Quantity::force), static_cast<int>(r.scene.loaded.size()),
                        r.scene.loaded_slot[n]);
    }
  }
  if (r.scene.drag_in_wind) pull_back_knots(r.scene.wind.at(r.at.t0), wind_bar, r.bar.of(Quantity::wind), 1, 0);
}

}  // namespace

EquilibriumDerivative::EquilibriumDerivative(const Scene& scene, const double* inputs, const Equilibrium& at)
    : scene_(scene), inputs_(inputs, inputs + scene.layout.total()), at_(at), kkt_(scene) {
  if (!at.converged) throw NoEquilibrium(at.message);
  const Inputs<const double> in{scene.layout, inputs_.data()};
  const RestingContacts<double> contacts(scene, in, at_.t0,
                                         at_.held.empty() ? in.of(Quantity::position) : at_.held.data());
  RestingModes modes;
  modes.decide(contacts, at_.x.data(), 0.0);
  kkt_.assemble(inputs, at_.x.data(), at_.lambda.data(), at_.force_stiffness, at_.left_out);
  kkt_.take_contacts(modes.blocks(contacts, at_.x.data()));
  if (!kkt_.factorize(0.0, compliances(scene, in).data()))
    throw NoEquilibrium(
        "equilibrium: the Newton matrix is singular, so the shape has no derivative (a fold, or a part that moves "
        "freely). Fix: hold "
        "every part, or move away from the critical load");
}

void EquilibriumDerivative::solve(std::vector<double>& x, std::vector<double>& lambda, bool transposed) const {
  if (!kkt_.solve(x.data(), lambda.data(), 1e-13, transposed))
    throw NoEquilibrium(
        "equilibrium: the linear solve of the derivative lost its accuracy. Fix: check for redundant rigid "
        "constraints, or for friction that holds a part at its limit alone");
}

void EquilibriumDerivative::vjp(const double* x_bar, const double* lambda_bar, double* inputs_bar) const {
  const Inputs<const double> in{scene_.layout, inputs_.data()};
  const Inputs<double> bar{scene_.layout, inputs_bar};
  std::vector<double> u(scene_.dofs(), 0.0), v(scene_.multipliers(), 0.0), fixed(scene_.dofs(), 0.0);
  if (x_bar) {
    u.assign(x_bar, x_bar + scene_.dofs());
    retract_directors_vjp<double>(scene_, [&](int node) { return &at_.x[scene_.first_dof[node]]; }, u.data());
    fixed = u;
  }
  if (lambda_bar) v.assign(lambda_bar, lambda_bar + scene_.multipliers());
  for (const RedundantRow& r : at_.left_out) v[r.row] = 0.0;
  solve(u, v, true);

  const Balance balance{scene_, in, at_, u, v, fixed, bar};
  pull_back_elements(balance);
  pull_back_pressure(balance);
  pull_back_kept_volumes(balance);
  pull_back_resting(balance);
  pull_back_held_and_loads(balance);
}

}  // namespace sheetbend
