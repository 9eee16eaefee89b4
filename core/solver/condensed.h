// The solve with A = J W J^T + D of a block whose constraints all give way, D = a/(1+g) > 0, through its particles:
//   A^-1 b = D^-1 (b - J H^-1 J^T D^-1 b),     H = W^-1 + J^T D^-1 J     (Woodbury)
// H is the Hessian of implicit Euler without the curvature of C: global Newton. A sheet has an eighth as many coordinates as scalar constraints, and its H
// a fraction of A's fill. One step of iterative refinement against A itself takes back the digits that the difference costs when D is small.
#pragma once

#include <algorithm>
#include <vector>

#include "core/solver/symmetric_factor.h"

namespace sheetbend {

// Which entries of H the constraints touch. Found once per plan.
struct Condensation {
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

// A block's numbers at one iteration.
template <class T>
struct BlockNumbers {
  const T *gradients, *x;  // rows of four: gradients by window; coordinates of the particles with their inverse masses
  const T* diagonal;       // D, per row
};

template <class T>
class CondensedFactor {
 public:
  void factorize(const Condensation& plan, const BlockNumbers<T>& block,
                 typename Factor<T>::FactorSupernodes compiled) {
    factor_.reset(plan.structure);
    for (std::size_t p = 0; p < plan.dof_of.size(); ++p) {
      const T mass = T(1.0) / block.x[4 * p + 3];
      for (int d = plan.dof_of[p]; d < plan.dof_of[p] + 3; ++d) factor_.values[plan.structure.position(d, d)] = mass;
    }
    stiffness_.resize(plan.members.empty() ? 0 : plan.members.back().first_row + plan.members.back().rows);
    for (const Condensation::Member& m : plan.members) {
      for (int row = m.first_row; row < m.first_row + m.rows; ++row) stiffness_[row] = T(1.0) / block.diagonal[row];
      const std::size_t* entry = &plan.entries[m.first_entry];
      for (int i = 0; i < m.uses; ++i) {
        const T* Gi = block.gradients + plan.gradients[m.first_use + i];
        scaled_.clear();
        for (int row = 0; row < m.rows; ++row)
          for (int a = 0; a < 3; ++a) scaled_.push_back(stiffness_[m.first_row + row] * Gi[4 * row + a]);
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
    factor_.factorize(plan.structure, compiled);
  }

  // b = A^-1 b, with the numbers that were factored.
  template <class U>
  void solve(const Condensation& plan, const BlockNumbers<T>& block, U* b) const {
    const std::size_t rows = stiffness_.size();
    std::vector<U>& work = scratch<U>();
    work.resize(3 * rows + plan.structure.size());
    U *y = work.data(), *rest = y + rows, *scaled = rest + rows, *z = scaled + rows;
    std::copy_n(b, rows, y);
    solve_once(plan, block, y, scaled, z);
    // rest = b - A y
    transpose_times(plan, block, y, z);
    for (std::size_t p = 0; p < plan.dof_of.size(); ++p)
      for (int d = plan.dof_of[p]; d < plan.dof_of[p] + 3; ++d) z[d] = block.x[4 * p + 3] * z[d];
    for (std::size_t i = 0; i < rows; ++i) rest[i] = b[i] - block.diagonal[i] * y[i];
    subtract_times(plan, block, z, rest);
    solve_once(plan, block, rest, scaled, z);
    for (std::size_t i = 0; i < rows; ++i) b[i] = y[i] + rest[i];
  }

 private:
  // y = D^-1 (y - J H^-1 J^T D^-1 y)
  template <class U>
  void solve_once(const Condensation& plan, const BlockNumbers<T>& block, U* y, U* scaled, U* z) const {
    const int rows = static_cast<int>(stiffness_.size());
    for (int i = 0; i < rows; ++i) scaled[i] = stiffness_[i] * y[i];
    transpose_times(plan, block, scaled, z);
    factor_.solve(plan.structure, z);
    subtract_times(plan, block, z, y);
    for (int i = 0; i < rows; ++i) y[i] = stiffness_[i] * y[i];
  }

  // z = J^T y
  template <class U>
  static void transpose_times(const Condensation& plan, const BlockNumbers<T>& block, const U* y, U* z) {
    std::fill_n(z, plan.structure.size(), U(0.0));
    for (const Condensation::Member& m : plan.members)
      for (int i = m.first_use; i < m.first_use + m.uses; ++i)
        for (int row = 0; row < m.rows; ++row)
          for (int a = 0; a < 3; ++a)
            z[plan.dofs[i] + a] += block.gradients[plan.gradients[i] + 4 * row + a] * y[m.first_row + row];
  }

  // b -= J z
  template <class U>
  static void subtract_times(const Condensation& plan, const BlockNumbers<T>& block, const U* z, U* b) {
    for (const Condensation::Member& m : plan.members)
      for (int i = m.first_use; i < m.first_use + m.uses; ++i)
        for (int row = 0; row < m.rows; ++row)
          for (int a = 0; a < 3; ++a)
            b[m.first_row + row] -= block.gradients[plan.gradients[i] + 4 * row + a] * z[plan.dofs[i] + a];
  }

  // No allocation once it has grown.
  template <class U>
  std::vector<U>& scratch() const {
    if constexpr (std::is_same_v<T, U>) {
      return scratch_;
    } else {
      thread_local std::vector<U> own;
      return own;
    }
  }

  Factor<T> factor_;
  std::vector<T> stiffness_;  // D^-1
  std::vector<T> scaled_;
  mutable std::vector<T> scratch_;
};

}  // namespace sheetbend
