#include "adjoint/equilibrium_vjp.h"

#include "adjoint/substep_vjp.h"

namespace sheetbend {

EquilibriumDerivative::EquilibriumDerivative(const Scene& scene, const double* inputs, const Equilibrium& at)
    : scene_(scene), inputs_(inputs, inputs + scene.layout.total()), at_(at), kkt_(scene) {
  if (!at.converged) throw NoEquilibrium(at.message);
  kkt_.assemble(inputs, at_.x.data(), at_.lambda.data(), at_.force_stiffness);
  if (!kkt_.factorize(0.0, inputs_.data() + scene.layout.of(Quantity::compliance)))
    throw NoEquilibrium(
        "equilibrium: the Newton matrix is singular, so the shape has no derivative (a fold, or a part that moves "
        "freely). Fix: hold "
        "every part, or move away from the critical load");
}

void EquilibriumDerivative::solve(std::vector<double>& x, std::vector<double>& lambda) const {
  if (!kkt_.solve(x.data(), lambda.data()))
    throw NoEquilibrium(
        "equilibrium: the linear solve of the derivative lost its accuracy. Fix: check for redundant rigid "
        "constraints");
}

void EquilibriumDerivative::vjp(const double* x_bar, const double* lambda_bar, double* inputs_bar) const {
  const Inputs<const double> in{scene_.layout, inputs_.data()};
  const Inputs<double> bar{scene_.layout, inputs_bar};
  std::vector<double> u(scene_.dofs(), 0.0), v(scene_.rows, 0.0), fixed(scene_.dofs(), 0.0);
  if (x_bar) {
    u.assign(x_bar, x_bar + scene_.dofs());
    retract_directors_vjp<double>(scene_, [&](int node) { return &at_.x[scene_.first_dof[node]]; }, u.data());
    fixed = u;
  }
  if (lambda_bar) v.assign(lambda_bar, lambda_bar + scene_.rows);
  solve(u, v);

  for_each_constraint(scene_, [&]<class K>(K, const Group& group, int item) {
    constexpr int P = parameter_count<K>;
    using D = Dual<double, P + 1>;
    double local[K::dofs], ul[K::dofs];
    gather<K>(scene_, group, item, at_.x.data(), local);
    gather<K>(scene_, group, item, u.data(), ul);
    D x[K::dofs], p[P + 1], C[K::rows], J[K::rows * K::dofs];
    for (int d = 0; d < K::dofs; ++d) {
      x[d].v = local[d];
      x[d].d[P] = ul[d];
    }
    for (int k = 0; k < P; ++k) {
      p[k].v = rest_parameters<K>(in, group, item)[k];
      p[k].d[k] = 1.0;
    }
    K::evaluate(x, p, C, J);
    double *rest_bar = bar.of(Quantity::rest) + group.first_value + static_cast<std::size_t>(item) * P,
           &alpha_bar = bar.of(Quantity::compliance)[group.first + item];
    for (int j = 0; j < K::rows; ++j) {
      const int row = group.first_row + item * K::rows + j;
      const double l = at_.lambda[row], vj = v[row];
      alpha_bar -= vj * l;
      for (int k = 0; k < P; ++k) {
        double sum = vj * C[j].d[k];
        for (int d = 0; d < K::dofs; ++d) sum += l * ul[d] * J[j * K::dofs + d].d[k];
        rest_bar[k] -= sum;
      }
      for (int d = 0; d < K::dofs; ++d)
        fixed[scene_.first_dof[group.nodes(item)[d / 3]] + d % 3] -=
            l * J[j * K::dofs + d].d[P] + vj * J[j * K::dofs + d].v;
    }
  });

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
      bar.of(Quantity::mass)[n] -= dot(un, gravity);
      (-in.of(Quantity::mass)[n] * un).add_to(bar.of(Quantity::gravity));
      if (scene_.loaded_slot[n] >= 0)
        pull_back_knots(force, -un, bar.of(Quantity::force), static_cast<int>(scene_.loaded.size()),
                        scene_.loaded_slot[n]);
    }
  }
}

}  // namespace sheetbend
