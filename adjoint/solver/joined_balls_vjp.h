// The reverse of core/solver/joined_balls.h. With B the cotangent of D, whose derivative follows from that of (M + J^T a^-1 J)^-1:
//
//   dD_cd = U_c . dM U_d + y_c . dJ U_d + U_c . dJ^T y_d - y_c . da y_d - [c = d] dm/m^2        dm/m^2: the sum over the balls
//
// The other solution that a reverse of a linear system asks for is U and y themselves.
#pragma once

#include "adjoint/element/any_kind_vjp.h"
#include "adjoint/solver/cotangents.h"
#include "core/solver/joined_balls.h"

namespace sheetbend {

// Of one constraint.
template <class T>
void joint_vjp(const ContactSource<T>& source, const JoinedBalls<T>& ball, const Member& m, const Matrix3<Single<T>>& B,
               T* x_bar, const Inputs<T>& in_bar) {
  using S = Single<T>;
  const Group& group = source.scene.groups[m.group];
  const auto nodes = group.nodes(m.item);
  const int dofs = 3 * group.arity;
  S x[largest_kind.dofs], p[largest_kind.parameters + 1], z[largest_kind.dofs], lambda[largest_kind.rows];
  S none[largest_kind.rows], own_x_bar[largest_kind.dofs], p_bar[largest_kind.parameters + 1];
  ball.read(m, x, p);
  for (S& a : none) a = S(0.0);
  for (int i = 0; i < dofs; ++i) own_x_bar[i] = S(0.0);
  for (int k = 0; k < group.parameters; ++k) p_bar[k] = S(0.0);
  S softness_bar(0.0);
  for (int d = 0; d < 3; ++d) {
    const S weight[3] = {B[d].x, B[d].y, B[d].z};
    for (int j = 0; j < group.rows; ++j) {
      lambda[j] = S(0.0);
      for (int c = 0; c < 3; ++c) lambda[j] += weight[c] * ball.y(m.first_row + j, c);
      softness_bar -= lambda[j] * ball.y(m.first_row + j, d);
      lambda[j] = S(2.0) * lambda[j];
    }
    for (int k = 0; k < group.arity; ++k) ball.U(nodes[k], d).store(z + 3 * k);
    pushes_vjp(group.kind, x, p, lambda, none, z, own_x_bar, p_bar);
  }
  for (int k = 0; k < group.arity; ++k)
    source.add(Vec3<S>(own_x_bar + 3 * k), x_bar + source.scene.first_dof[nodes[k]]);
  for (int k = 0; k < group.parameters; ++k)
    source.add(p_bar[k], in_bar.of(Quantity::rest)[JoinedBalls<T>::first_parameter(group, m) + k]);
  const Rates<S> rates = ball.rates(m);
  const S a_bar = rates.scale * softness_bar, g_bar = -(rates.a * rates.scale * a_bar);
  const int c = group.first + m.item;
  const double eta = source.bdf.eta;
  source.add(S(1.0 / (eta * eta)) * a_bar, in_bar.of(Quantity::compliance)[c]);
  if (!group.damped) return;
  source.add(S(1.0 / eta) * g_bar * source.read(source.in.of(Quantity::damping)[c]),
             in_bar.of(Quantity::compliance)[c]);
  source.add(S(1.0 / eta) * g_bar * source.read(source.in.of(Quantity::compliance)[c]),
             in_bar.of(Quantity::damping)[c]);
}

// Cotangents of what is taken go to the state at n and to the inputs. They are symmetric, as D is.
template <class T>
void taken_vjp(const ContactSource<T>& source, const Plan& plan, int one, int other, const Matrix3<Single<T>>& B,
               T* x_bar, const Inputs<T>& in_bar) {
  using S = Single<T>;
  const auto mass_bar = [&](int n) -> T& { return in_bar.of(Quantity::mass)[n]; };
  for_each_joined(source, plan, one, other, [&](const Assembly& assembly, const JoinedBalls<T>& balls) {
    for (const auto& joined : assembly.joined)
      for (int d = 0; d < 3; ++d) {
        const S weight[3] = {B[d].x, B[d].y, B[d].z};
        for (int c = 0; c < 3; ++c)
          source.add(weight[c] * dot(balls.U(joined.first, c), balls.U(joined.first, d)), mass_bar(joined.first));
      }
    for (const int node : balls.balls()) {
      if (node == JoinedBalls<T>::nothing) continue;
      const S m = balls.mass(node);
      source.add(-((B[0].x + B[1].y + B[2].z) / (m * m)), mass_bar(node));
    }
    for (const Member& member : assembly.members) joint_vjp(source, balls, member, B, x_bar, in_bar);
  });
}

}  // namespace sheetbend
