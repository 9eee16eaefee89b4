// H^-1 by factors: H = W^-1 + J^T D^-1 J is formed and factored.
#pragma once

#include <vector>

#include "core/solver/block_numbers.h"
#include "core/solver/symmetric_factor.h"

namespace sheetbend {

// Which entries of H the constraints touch. Found once per plan.
struct CondensedPattern {
  // A constraint's rows, and its movable particles: their places in the block's arrays of gradients and in H.
  struct Member {
    int first_row, rows;
    int first_use, uses;      // into `gradients` and `dofs`
    std::size_t first_entry;  // into `entries`
  };
  FactorStructure structure{0, {}, false};
  std::vector<Member> members;
  std::vector<int> gradients;        // per use: where the particle's gradients of the member's rows stand
  std::vector<int> dofs;             // per use: first dof in H
  std::vector<int> dof_of;           // per movable particle: the same
  std::vector<std::size_t> entries;  // per pair of uses with dofs descending, three: where its columns stand in H
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
    for (const CondensedPattern::Member& m : plan.members) add(plan, m, block, stiffness + m.first_row);
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
  // One constraint's share of J^T D^-1 J.
  void add(const CondensedPattern& plan, const CondensedPattern::Member& m, const BlockNumbers<T>& block,
           const T* stiffness) {
    const std::size_t* entry = &plan.entries[m.first_entry];
    for (int i = 0; i < m.uses; ++i) {
      const T* Gi = block.gradients + plan.gradients[m.first_use + i];
      scaled_.clear();
      for (int row = 0; row < m.rows; ++row)
        for (int a = 0; a < 3; ++a) scaled_.push_back(stiffness[row] * Gi[4 * row + a]);
      for (int k = 0; k < m.uses; ++k) {
        if (plan.dofs[m.first_use + k] > plan.dofs[m.first_use + i]) continue;
        const T* Gk = block.gradients + plan.gradients[m.first_use + k];
        T sum[9]{};
        for (int row = 0; row < m.rows; ++row)
          for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b) sum[3 * a + b] += scaled_[3 * row + a] * Gk[4 * row + b];
        for (int b = 0; b < 3; ++b, ++entry)
          for (int a = i == k ? b : 0; a < 3; ++a) factor_.values[*entry + a] += sum[3 * a + b];
      }
    }
  }

  Factor<T> factor_;
  std::vector<T> scaled_;
};

}  // namespace sheetbend
