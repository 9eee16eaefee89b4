// The constraints' shares of H = W^-1 + J^T D^-1 J: 3 x 3 numbers per constraint and pair of its particles.
#pragma once

#include <vector>

#include "core/linear/block_numbers.h"

namespace sheetbend {

struct CondensedShares {
  // A constraint's rows, and its movable particles: their places in the block's arrays of gradients and in H.
  struct Member {
    int first_row, rows;
    int first_use, uses;  // into `gradients` and `dofs`
  };
  std::vector<Member> members;
  std::vector<int> gradients;  // per use: where the particle's gradients of the member's rows stand
  std::vector<int> dofs;       // per use: first dof in H

  std::size_t bytes() const { return sizeof(Member) * members.size() + sizeof(int) * (gradients.size() + dofs.size()); }

  // f(member, use i, use k) for each pair in H's lower triangle.
  template <class F>
  void for_each_pair(F&& f) const {
    for (const Member& m : members)
      for (int i = m.first_use; i < m.first_use + m.uses; ++i)
        for (int k = m.first_use; k < m.first_use + m.uses; ++k)
          if (dofs[k] <= dofs[i]) f(m, i, k);
  }

  // f(i, k, numbers) for the same pairs in the same order: three rows of i by three columns of k, as coefficients of U.
  template <class U, class T, class F>
  void for_each(const BlockNumbers<T>& block, const T* stiffness, F&& f) const {
    using Number = decltype(coefficient<U>(T()));
    for_each_pair([&](const Member& m, int i, int k) {
      const T *Gi = block.gradients + gradients[i], *Gk = block.gradients + gradients[k];
      Number sum[9];
      for (Number& s : sum) s = Number(0.0);
      for (int row = 0; row < m.rows; ++row)
        for (int a = 0; a < 3; ++a) {
          const Number kG = coefficient<U>(stiffness[m.first_row + row]) * coefficient<U>(Gi[4 * row + a]);
          for (int b = 0; b < 3; ++b) sum[3 * a + b] += kG * coefficient<U>(Gk[4 * row + b]);
        }
      f(i, k, sum);
    });
  }
};

}  // namespace sheetbend
