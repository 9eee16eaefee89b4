// Balls that constraints join to other particles, all of which an impact pushes. With M the masses of what is joined, J the gradients of the constraints at the
// state that a substep starts from, and a their compliance over eta^2, an impulse P on a ball changes velocities by U P, and that of the ball by (1/m - D) P:
//
//   y = A^-1 J M^-1 E,  A = J M^-1 J^T + a       E: the rows of the ball
//   U = M^-1 (E - J^T y) = (M + J^T a^-1 J)^-1 E
//   D = 1/m - E^T U
//
// Two balls that the same constraints join have one E: that of the first less that of the second, for they are pushed apart. The inverse mass that both have
// together is then E^T U = 1/m1 + 1/m2 - D.
//
// Soft constraints, of which a is large, take nothing. Tethers, kept volumes and constraints of the frames of rods are left out.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "core/constraints/any_kind.h"
#include "core/element/element.h"
#include "core/linear/symmetric_factor.h"
#include "core/solver/contact_source.h"
#include "core/solver/plan.h"

namespace sheetbend {

// Three columns.
template <class S>
using Matrix3 = std::array<Vec3<S>, 3>;

// y and U of a push on a ball, or on two that it parts, in one scene of a T.
template <class T>
class JoinedBalls {
 public:
  using S = Single<T>;
  static constexpr int nothing = -1;

  JoinedBalls(const ContactSource<T>& source, const Assembly& assembly, int one, int other = nothing)
      : source_(source), assembly_(assembly), balls_{one, other}, U_(assembly.joined.size()) {
    for (auto& column : y_) column.assign(Factor<S>::right_side(assembly.structure), S(0.0));
    load_gradients();
    solve();
    for (std::size_t i = 0; i < U_.size(); ++i) {
      const auto& [node, uses] = assembly.joined[i];
      for (int d = 0; d < 3; ++d) {
        Vec3<S>& u = U_[i][d];
        if (const double sign = sign_of(node); sign != 0.0) u = S(sign) * unit(d);
        for_each_row(uses, [&](int row, const Vec3<S>& gradient) { u = u - y_[d][row] * gradient; });
        u = (S(1.0) / mass(node)) * u;
      }
    }
  }

  Matrix3<S> D() const {
    Matrix3<S> D;
    for (const int ball : balls_)
      if (ball != nothing)
        for (int d = 0; d < 3; ++d) D[d] = D[d] + (S(1.0) / mass(ball)) * unit(d) - S(sign_of(ball)) * U(ball, d);
    return D;
  }

  const std::array<int, 2>& balls() const { return balls_; }
  S mass(int node) const { return source_.read(source_.in.of(Quantity::mass)[node]); }
  const S& y(int row, int direction) const { return y_[direction][row]; }
  // Of what cannot move it is zero.
  Vec3<S> U(int node, int direction) const {
    const auto& all = assembly_.joined;
    const auto at = std::lower_bound(all.begin(), all.end(), node, [](const auto& j, int n) { return j.first < n; });
    return at == all.end() || at->first != node ? Vec3<S>() : U_[at - all.begin()][direction];
  }

  Rates<S> rates(const Member& m) const {
    const Group& group = source_.scene.groups[m.group];
    const int c = group.first + m.item;
    return {source_.read(source_.in.of(Quantity::compliance)[c]),
            group.damped ? source_.read(source_.in.of(Quantity::damping)[c]) : S(0.0), source_.bdf.eta};
  }
  // The coordinates and the parameters of a constraint.
  void read(const Member& m, S* x, S* p) const {
    const Group& group = source_.scene.groups[m.group];
    const auto nodes = group.nodes(m.item);
    for (int k = 0; k < group.arity; ++k) source_.at(source_.from.x, nodes[k]).store(x + 3 * k);
    const T* own = source_.in.of(Quantity::rest) + first_parameter(group, m);
    for (int k = 0; k < group.parameters; ++k) p[k] = source_.read(own[k]);
  }
  static std::size_t first_parameter(const Group& group, const Member& m) {
    return group.first_value + static_cast<std::size_t>(m.item) * group.parameters;
  }

 private:
  double sign_of(int node) const { return node == balls_[0] ? 1.0 : node == balls_[1] ? -1.0 : 0.0; }
  static Vec3<S> unit(int d) { return {S(d == 0 ? 1.0 : 0.0), S(d == 1 ? 1.0 : 0.0), S(d == 2 ? 1.0 : 0.0)}; }

  // Calls f(row, gradient) for these rows, with their gradients at the node that uses them.
  template <class F>
  void for_each_row(const std::vector<RowUse>& uses, F&& f) const {
    for (const auto& [row, place] : uses) f(row, Vec3<S>(&J_[row][3 * place]));
  }

  void load_gradients() {
    AnyConstraint<S> element;
    S p[largest_kind.parameters + 1];
    for (const Member& m : assembly_.members) {
      read(m, element.x, p);
      element.evaluate(source_.scene.groups[m.group].kind, p);
      for (int j = 0; j < element.kind->rows; ++j) {
        const S* row = element.J + j * element.kind->dofs;
        J_.emplace_back(row, row + element.kind->dofs);
      }
    }
  }

  void solve() {
    const FactorStructure& structure = assembly_.structure;
    Factor<S> A;
    A.reset(structure);
    for (const Member& m : assembly_.members)
      for (int j = 0; j < source_.scene.groups[m.group].rows; ++j)
        A.values[structure.position(m.first_row + j, m.first_row + j)] = rates(m).a * rates(m).scale;
    for (const auto& [node, uses] : assembly_.joined) {
      const S w = S(1.0) / mass(node);
      for_each_row(uses, [&](int row, const Vec3<S>& own) {
        for_each_row(uses, [&](int column, const Vec3<S>& other) {
          if (column <= row) A.values[structure.position(row, column)] += w * dot(own, other);
        });
        if (const double sign = sign_of(node); sign != 0.0)
          for (int d = 0; d < 3; ++d) y_[d][row] += S(sign) * w * dot(own, unit(d));
      });
    }
    A.factorize(structure);
    for (auto& column : y_) A.solve(structure, column.data());
  }

  const ContactSource<T>& source_;
  const Assembly& assembly_;
  std::array<int, 2> balls_;         // nodes
  std::vector<std::vector<S>> J_;    // per row
  std::array<std::vector<S>, 3> y_;  // per row
  std::vector<Matrix3<S>> U_;        // of each that is joined
};

// Calls f with what joins two balls to others: at once where the same constraints join both.
template <class T, class F>
void for_each_joined(const ContactSource<T>& source, const Plan& plan, int one, int other, F&& f) {
  const auto node = [&](int ball) { return source.scene.balls.members[ball].node; };
  const int a = plan.assembly_of_ball[one], b = plan.assembly_of_ball[other];
  if (a >= 0 && a == b)
    return f(plan.assemblies[a], JoinedBalls<T>(source, plan.assemblies[a], node(one), node(other)));
  if (a >= 0) f(plan.assemblies[a], JoinedBalls<T>(source, plan.assemblies[a], node(one)));
  if (b >= 0) f(plan.assemblies[b], JoinedBalls<T>(source, plan.assemblies[b], node(other)));
}

// What is taken of the inverse mass of two balls that hit each other; nothing where none is joined to others.
template <class T>
std::optional<Matrix3<Single<T>>> taken_of(const ContactSource<T>& source, const Plan& plan, int one, int other) {
  std::optional<Matrix3<Single<T>>> sum;
  for_each_joined(source, plan, one, other, [&](const Assembly&, const JoinedBalls<T>& joined) {
    if (!sum) sum.emplace();
    const auto D = joined.D();
    for (int d = 0; d < 3; ++d) (*sum)[d] = (*sum)[d] + D[d];
  });
  return sum;
}

}  // namespace sheetbend
