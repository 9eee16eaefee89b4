#include "adjoint/equilibrium_vjp.h"

#include "adjoint/element/any_kind_vjp.h"
#include "adjoint/resting_vjp.h"
#include "adjoint/step/substep.h"

namespace sheetbend {

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

  AnyConstraint<double> own;
  for_each_constraint(scene_, [&](const Group& group, int item) {
    const int first_row = group.first_row + item * group.rows, dofs = 3 * group.arity;
    double away[largest_kind.dofs], by[largest_kind.dofs]{};
    evaluate(scene_, in, group, item, at_.x.data(), own);
    gather(scene_, group, item, u.data(), away);
    for (int d = 0; d < dofs; ++d) away[d] = -away[d];
    const double* p = rest_parameters(in, group, item);
    double* p_bar = bar.of(Quantity::rest) + (p - in.of(Quantity::rest));
    pushes_vjp(group.kind, own.x, p, &at_.lambda[first_row], &v[first_row], away, by, p_bar);
    for (int j = 0; j < group.rows; ++j) {
      bar.of(Quantity::compliance)[group.first + item] -= v[first_row + j] * at_.lambda[first_row + j];
      for (int d = 0; d < dofs; ++d) by[d] -= v[first_row + j] * own.J[j * dofs + d];
    }
    for (int d = 0; d < dofs; ++d) fixed[scene_.first_dof[group.nodes(item)[d / 3]] + d % 3] += by[d];
  });

  for_each_pressed(scene_, in, [&](int i, const std::array<int, 3>& nodes, double p) {
    Vec3<double> pushed;
    for (const int n : nodes)
      if (scene_.inertial[n]) pushed = pushed + Vec3<double>(&u[scene_.first_dof[n]]);
    const auto [a, b, c] = corners_at<double>(scene_, nodes, at_.x.data());
    bar.of(Quantity::pressure)[i] -= dot(pushed, cross(b - a, c - a)) / 6.0;
    const Vec3<double> N_bar = -p / 6.0 * pushed, b_bar = cross(c - a, N_bar), c_bar = cross(N_bar, b - a);
    (-(b_bar + c_bar)).add_to(&fixed[scene_.first_dof[nodes[0]]]);
    b_bar.add_to(&fixed[scene_.first_dof[nodes[1]]]);
    c_bar.add_to(&fixed[scene_.first_dof[nodes[2]]]);
  });

  std::vector<Vec3<double>> x, along, gradient;
  for (int i = 0; i < static_cast<int>(scene_.volumes.size()); ++i) {
    const Volume& volume = scene_.volumes[i];
    const double p = at_.lambda[scene_.rows + i], v_here = v[scene_.rows + i];
    const auto dof = [&](std::size_t k) { return scene_.first_dof[volume.nodes[k]]; };
    for (auto* a : {&x, &along, &gradient}) a->resize(volume.nodes.size());
    place_volume([&](std::size_t k) { return Vec3<double>(&at_.x[dof(k)]); }, x);
    enclosed(volume, x, gradient);
    for (std::size_t k = 0; k < x.size(); ++k) {
      along[k] = -p * Vec3<double>(&u[dof(k)]);
      (-v_here * gradient[k]).add_to(&fixed[dof(k)]);
    }
    for_each_hessian_times(volume, x, along, [&](int k, const Vec3<double>& share) { share.add_to(&fixed[dof(k)]); });
    bar.of(Quantity::volume)[i] += v_here;
    bar.of(Quantity::volume_compliance)[i] -= v_here * p;
  }

  std::vector<double> away(u.size());
  for (std::size_t i = 0; i < u.size(); ++i) away[i] = -u[i];
  std::vector<double> given(at_.held.size());
  const RestingContacts<double> contacts(scene_, in, at_.t0,
                                         given.empty() ? in.of(Quantity::position) : at_.held.data());
  resting_vjp(contacts, at_.x.data(), away.data(), given.empty() ? bar.of(Quantity::position) : given.data(), bar);

  const Vec3<double> gravity(in.of(Quantity::gravity));
  const KnotWeights boundary = scene_.driven.empty() ? KnotWeights{} : scene_.boundary.at(at_.t0);
  const KnotWeights force = scene_.loaded.empty() ? KnotWeights{} : scene_.force.at(at_.t0);
  for (int n = 0; n < scene_.nodes(); ++n) {
    const Vec3<double> un(&u[scene_.first_dof[n]]), held(&fixed[scene_.first_dof[n]]);
    if (scene_.role[n] == Role::pinned) {
      held.add_to(bar.of(Quantity::position) + scene_.first_dof[n]);
    } else if (scene_.role[n] == Role::driven) {
      pull_back_knots(boundary, held, bar.of(Quantity::boundary), static_cast<int>(scene_.driven.size()),
                      scene_.driven_slot[n]);
    } else if (scene_.inertial[n]) {
      if (scene_.has_weight[n]) {
        bar.of(Quantity::mass)[n] -= dot(un, gravity);
        (-in.of(Quantity::mass)[n] * un).add_to(bar.of(Quantity::gravity));
      }
      if (scene_.loaded_slot[n] >= 0)
        pull_back_knots(force, -un, bar.of(Quantity::force), static_cast<int>(scene_.loaded.size()),
                        scene_.loaded_slot[n]);
    }
  }
}

}  // namespace sheetbend
