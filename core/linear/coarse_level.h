// The coarse level of conjugate gradients: each aggregate of particles moves as a rigid body, z_i = t + w x (x_i - c), and the matrix T^T H T of these
// motions is factored.
#pragma once

#include <vector>

#include "core/linear/aggregation.h"

namespace sheetbend {

template <class P>
class CoarseLevel {
 public:
  // H by blocks, as Aggregation lists them; x(i, d) are coordinates.
  template <class Coordinates>
  void factorize(const Aggregation& plan, const P* blocks, Coordinates&& x,
                 typename Factor<P>::FactorSupernodes compiled) {
    find_arms(plan, x);
    factor_.reset(plan.coarse);
    for (std::size_t i = 0; i < plan.dof_of.size(); ++i)
      for (int k = plan.start[i]; k < plan.start[i + 1]; ++k)
        add(plan, static_cast<int>(i), k, blocks + 9 * static_cast<std::size_t>(k));
    // A body of one or two particles does not feel every turn: what rounding leaves of such a pivot shall divide nothing.
    for (int d = 0; d < plan.coarse.size(); ++d) {
      P& pivot = factor_.values[plan.coarse.position(d, d)];
      pivot = pivot * P(1.0 + 1e-12);
    }
    factor_.factorize(plan.coarse, compiled);
  }

  // z += T (T^T H T)^-1 T^T rest. `room` has work() numbers.
  template <class V>
  void correct(const Aggregation& plan, const V* rest, V* z, V* room) const {
    std::fill_n(room, plan.coarse.size(), V(0.0));
    for (std::size_t i = 0; i < plan.dof_of.size(); ++i) {
      const Vec3<V> force(rest + 3 * i);
      V* body = room + plan.dof_of[i];
      force.add_to(body);
      cross(arm<V>(i), force).add_to(body + 3);
    }
    factor_.solve(plan.coarse, room);
    for (std::size_t i = 0; i < plan.dof_of.size(); ++i) {
      const V* body = room + plan.dof_of[i];
      (Vec3<V>(body) + cross(Vec3<V>(body + 3), arm<V>(i))).add_to(z + 3 * i);
    }
  }

  static std::size_t bytes(const Aggregation& plan) {
    const std::size_t numbers = 3 * plan.dof_of.size() + plan.coarse.size();
    return sizeof(P) * numbers + Factor<P>::bytes(plan.coarse);
  }
  static std::size_t work(const Aggregation& plan) { return plan.coarse.size(); }

 private:
  // Particles seen from their aggregate's mean.
  template <class Coordinates>
  void find_arms(const Aggregation& plan, Coordinates&& x) {
    const std::size_t particles = plan.dof_of.size();
    mean_.assign(plan.coarse.size(), P(0.0));
    arms_.resize(3 * particles);
    for (std::size_t i = 0; i < particles; ++i) {
      P* body = &mean_[plan.dof_of[i]];
      for (int d = 0; d < 3; ++d) body[d] += x(i, d);
      body[3] += P(1.0);
    }
    for (std::size_t i = 0; i < particles; ++i) {
      const P* body = &mean_[plan.dof_of[i]];
      for (int d = 0; d < 3; ++d) arms_[3 * i + d] = x(i, d) - body[d] / body[3];
    }
  }

  template <class V>
  Vec3<V> arm(std::size_t i) const {
    return {V(arms_[3 * i]), V(arms_[3 * i + 1]), V(arms_[3 * i + 2])};
  }

  // The share of one block of H, and of its mirror image above the diagonal where both stand in the coarse matrix's lower triangle.
  void add(const Aggregation& plan, int i, int k, const P* block) {
    const int j = plan.column[k];
    P share[modes][modes];
    for (int a = 0; a < 3; ++a) {
      const Vec3<P> row(block + 3 * a);
      row.store(share[a]);
      cross(arm<P>(j), row).store(share[a] + 3);
    }
    for (int b = 0; b < modes; ++b) {
      const Vec3<P> turned = cross(arm<P>(i), Vec3<P>(share[0][b], share[1][b], share[2][b]));
      share[3][b] = turned.x, share[4][b] = turned.y, share[5][b] = turned.z;
    }
    const std::size_t* columns = &plan.coarse_column[modes * static_cast<std::size_t>(plan.coarse_entry[k])];
    const int row = plan.dof_of[i], column = plan.dof_of[j];
    for (int b = 0; b < modes; ++b)
      for (int a = row == column ? b : 0; a < modes; ++a) {
        P& entry = factor_.values[columns[b] + a];
        if (row >= column) entry += share[a][b];
        if (row < column || (row == column && i != j)) entry += share[b][a];
      }
  }

  static constexpr int modes = Aggregation::modes;
  std::vector<P> arms_, mean_;
  Factor<P> factor_;
};

}  // namespace sheetbend
