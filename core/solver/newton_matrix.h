// The matrix of Newton's method for the incremental potential,
//
//   K = W^-1 + J^T D^-1 J - sum lambda Hess(C)         D = a/(1+g)
//
// as the sum of masses and one symmetric matrix per constraint, and its factors. Where K is not positive definite, a part of the way to the matrix in
// which no constraint's share has negative eigenvalues (Teran et al. 2005; on demand: Longva et al. 2023) is.
#pragma once

#include <vector>

#include "core/solver/incremental_potential.h"

namespace sheetbend {

// E (dofs, dofs), row by row, without its negative eigenvalues; of at most the most dofs that a constraint has.
void make_convex(int dofs, double* E);

class NewtonMatrix {
 public:
  void resize(const Scene& scene, const DirectBlock& block);
  static std::size_t bytes(const Scene& scene, const DirectBlock& block);

  // K at `at`.
  void find(const DirectBlock& block, IncrementalPotential& potential, Numbers<double>& at);

  // Factors K so much of the way to the convex matrix, from 0 for K itself to 1. Says whether that is positive definite.
  bool factorize(const Scene& scene, const DirectBlock& block, double convexity);
  // The first of a few shares at which it is; returns it.
  double factorize_convex_enough(const Scene& scene, const DirectBlock& block);

  // z = K^-1 z with what was factored, three numbers per movable particle; z may be over a larger scalar.
  template <class U>
  void solve(const DirectBlock& block, U* z) const {
    const CondensedPattern& pattern = pattern_of(block);
    thread_local std::vector<U> room;
    room.resize(pattern.structure.size());
    for (std::size_t p = 0; p < pattern.dof_of.size(); ++p) std::copy_n(z + 3 * p, 3, &room[pattern.dof_of[p]]);
    factor_.solve(pattern.structure, room.data());
    for (std::size_t p = 0; p < pattern.dof_of.size(); ++p) std::copy_n(&room[pattern.dof_of[p]], 3, z + 3 * p);
  }

  // Kz = K z on rows of four; of fixed particles what the constraints alone make of it.
  void multiply(const DirectBlock& block, Numbers<double>& z, Numbers<double>& Kz);

  // d = L^-T e of the first pivot that is not positive, a direction in which what was factored is not convex. False where there is none.
  bool find_negative_direction(const DirectBlock& block, double* d);

 private:
  static const CondensedPattern& pattern_of(const DirectBlock& block) {
    return std::get<CondensedPattern>(*block.condensation);
  }
  void find_convex(const Scene& scene, const DirectBlock& block);

  sheetbend_blocks::Potential arrays_{};            // of the last find()
  std::vector<double> masses_;                      // per movable particle
  std::vector<Numbers<double>> elements_, convex_;  // per run: (packs, triangle(dofs), 8)
  std::vector<double*> element_numbers_;
  bool convex_found_ = false;
  Factor<double> factor_;
};

}  // namespace sheetbend
