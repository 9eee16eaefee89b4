// H^-1 by factors: H = W^-1 + J^T D^-1 J is formed and factored.
#pragma once

#include <vector>

#include "core/linear/condensed_shares.h"
#include "core/linear/symmetric_factor.h"

namespace sheetbend {

// Which entries of H the constraints touch. Found once per plan.
struct CondensedPattern {
  FactorStructure structure{0, {}, false};
  CondensedShares shares;
  std::vector<int> dof_of;                    // per movable particle: first dof in H
  std::vector<std::size_t> entries;           // per pair of the shares, three: where its columns stand in H
  std::vector<std::vector<int>> joined = {};  // of blocks that may touch themselves: particles with entries in common

  std::size_t bytes() const {
    return structure.bytes() + shares.bytes() + sizeof(int) * dof_of.size() + sizeof(std::size_t) * entries.size();
  }
};

template <class T>
class CondensedFactor {
 public:
  void factorize(const CondensedPattern& plan, const BlockNumbers<T>& block, const T* stiffness,
                 typename Factor<T>::FactorSupernodes compiled) {
    factor_.reset(plan.structure);
    for (int p = 0; p < block.movable; ++p) {
      const T mass = T(1.0) / block.inverse_mass(p);
      for (int d = plan.dof_of[p]; d < plan.dof_of[p] + 3; ++d) factor_.values[plan.structure.position(d, d)] = mass;
    }
    const std::size_t* entry = plan.entries.data();
    plan.shares.for_each<T>(block, stiffness, [&](int i, int k, const T* share) {
      for (int b = 0; b < 3; ++b, ++entry)
        for (int a = i == k ? b : 0; a < 3; ++a) factor_.values[*entry + a] += share[3 * a + b];
    });
    factor_.factorize(plan.structure, compiled);
  }

  // z = H^-1 z, three numbers per movable particle. `room` has work() numbers.
  template <class U>
  void solve(const CondensedPattern& plan, U* z, U* room) const {
    const std::size_t particles = plan.dof_of.size();
    for (std::size_t p = 0; p < particles; ++p) std::copy_n(z + 3 * p, 3, room + plan.dof_of[p]);
    factor_.solve(plan.structure, room);
    for (std::size_t p = 0; p < particles; ++p) std::copy_n(room + plan.dof_of[p], 3, z + 3 * p);
  }

  static std::size_t work(std::size_t movable) { return 3 * movable; }

 private:
  Factor<T> factor_;
};

}  // namespace sheetbend
