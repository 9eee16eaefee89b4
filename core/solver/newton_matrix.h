// The matrix of Newton's method for the incremental potential,
//
//   K = W^-1 + J^T D^-1 J - sum lambda Hess(C)         D = a/(1+g)
//
// as the sum of masses and one symmetric matrix per constraint, and its factors. Where K is not positive definite, a part of the way to the matrix in
// which no constraint's share has negative eigenvalues (Teran et al. 2005; on demand: Longva et al. 2023) is. Contacts add a 3 x 3 matrix M to the
// particle that touches, or b_i b_k M to the pairs of particles that carry the point, and pairs that touch add one of 12 x 12 likewise. Contacts that slide are
// not symmetric, and K is factored as LU then. Rows that do not give way add what rigid_rows.h says: K is softened there.
#pragma once

#include <optional>
#include <vector>

#include "core/linear/unsymmetric_factor.h"
#include "core/solver/incremental_potential.h"
#include "core/solver/newton_iteration.h"
#include "core/solver/paired_pattern.h"

namespace sheetbend {

// E (dofs, dofs), row by row, without its negative eigenvalues; of at most the most dofs that a constraint has.
void make_convex(int dofs, double* E);

class NewtonMatrix {
 public:
  void resize(const Scene& scene, const DirectBlock& block);
  static std::size_t bytes(const Scene& scene, const DirectBlock& block);

  // A substep begins: the pattern is that of its pairs alone, so that bits do not depend on where a rollout begins.
  void begin() { begins_ = iterates_ = true; }

  // K at `at`; Newton's method does without the curvature of colliders and what frames do along idle directions (block_frames.h), derivatives do not.
  void find(const Scene& scene, const DirectBlock& block, IncrementalPotential& potential, Numbers<double>& at,
            bool curved = false);
  bool symmetric() const { return symmetric_; }
  bool rubs() const { return rubs_; }  // whether friction or dissipation of contacts acts

  // Factors K so much of the way to the convex matrix, from 0 for K itself to 1. Says whether that is positive definite.
  bool factorize(const Scene& scene, const DirectBlock& block, double convexity);
  // The first of a few shares at which it is; returns it.
  double factorize_convex_enough(const Scene& scene, const DirectBlock& block);
  // The same as LU, whether it is symmetric and positive definite or not. Says whether it has an inverse. Of blocks with contacts.
  bool factorize_unsymmetric(const Scene& scene, const DirectBlock& block, double convexity);

  // z = K^-1 z or z = K^-T z with what was factored, three numbers per movable particle; z may be over a larger scalar.
  template <class U>
  void solve(const DirectBlock& block, U* z) const {
    in_places(block, z, [&](const CondensedPattern& pattern, U* room) {
      if (as_lu_)
        lu_.solve(pattern.structure, room);
      else
        factor_.solve(pattern.structure, room);
    });
  }
  template <class U>
  void solve_transposed(const DirectBlock& block, U* z) const {
    if (!as_lu_) return solve(block, z);
    in_places(block, z,
              [&](const CondensedPattern& pattern, U* room) { lu_.solve_transposed(pattern.structure, room); });
  }

  // z = K^-1 z or K^-T z without a factor, so that no more than this share of z is left, three numbers per movable particle. False, with z as it was,
  // where nothing rubs or a factor is less work.
  bool iterate(const Scene& scene, const DirectBlock& block, double tolerance, bool transposed, double* z);

  // Kz = K z on rows of four; of fixed particles what the constraints alone make of it.
  void multiply(const DirectBlock& block, Numbers<double>& z, Numbers<double>& Kz);

  // d = L^-T e of the first pivot that is not positive, a direction in which what was factored is not convex. False where there is none.
  bool find_negative_direction(const DirectBlock& block, double* d);

 private:
  // The plan's pattern, or one with pairs where any touches.
  const CondensedPattern& pattern_of(const DirectBlock& block) const {
    return pairs_.empty() ? std::get<CondensedPattern>(*block.condensation) : paired_->pattern;
  }
  const std::vector<int>& entries_of_run(const DirectBlock& block, std::size_t r) const {
    return pairs_.empty() ? block.runs[r].entries : paired_->entries[r];
  }
  template <class U, class F>
  void in_places(const DirectBlock& block, U* z, F&& solve) const {
    const CondensedPattern& pattern = pattern_of(block);
    thread_local std::vector<U> room;
    room.resize(pattern.structure.size());
    for (std::size_t p = 0; p < pattern.dof_of.size(); ++p) std::copy_n(z + 3 * p, 3, &room[pattern.dof_of[p]]);
    solve(pattern, room.data());
    for (std::size_t p = 0; p < pattern.dof_of.size(); ++p) std::copy_n(&room[pattern.dof_of[p]], 3, z + 3 * p);
  }
  void find_convex(const Scene& scene, const DirectBlock& block);
  // f(particle, particle, weight, matrix) over the pairs of particles that contacts add to.
  template <class F>
  void for_each_contact(const DirectBlock& block, F&& f) const {
    for (std::size_t i = 0; i < block.contacts.size(); ++i) {
      const BlockContact& c = block.contacts[i];
      const auto& b = weights_[i];
      for (int k = 0; k < c.nodes; ++k)
        for (int l = 0; l < c.nodes; ++l)
          f(c.particles[k], c.particles[l], c.nodes == 1 ? 1.0 : b[k] * b[l], &contacts_[9 * i]);
    }
  }
  void find_contacts(const DirectBlock& block, const BlockContacts<double>& contacts, const double* x, bool curved);
  void find_pairs(const Scene& scene, const DirectBlock& block, const IncrementalPotential& potential, const double* x);
  void find_pattern(const Scene& scene, const DirectBlock& block, const BlockPairs& pairs);
  void add_pairs(const DirectBlock& block, double convexity);
  struct TouchingPair;
  // f(particle, particle, weight, k, l) over the pairs of particles that the block (k, l) of a touching pair's matrix adds to.
  template <class F>
  void for_each_block(const TouchingPair& pair, F&& f) const {
    for (int k = 0; k < 4; ++k)
      for (int l = 0; l < 4; ++l)
        spots_.for_each_node(pair.spots[k], [&](int p, double b) {
          spots_.for_each_node(pair.spots[l], [&](int q, double c) { f(p, q, b * c, k, l); });
        });
  }
  void assemble(const Scene& scene, const DirectBlock& block, double convexity);          // without contacts and pairs
  void multiply_held(const DirectBlock& block, Numbers<double>& z, Numbers<double>& Kz);  // likewise

  sheetbend_blocks::Potential arrays_{};            // of the last find()
  std::vector<double> masses_;                      // per movable particle
  std::vector<Numbers<double>> elements_, convex_;  // per run: (packs, triangle(dofs), 8)
  std::vector<double*> element_numbers_;
  std::vector<double> contacts_;                               // per contact: its matrix (3, 3)
  std::vector<std::array<double, most_point_nodes>> weights_;  // likewise, of its particles
  // Of pairs that touch: their matrices, and the pattern with all pairs that may touch, which grows in a substep and is kept while they recur.
  struct TouchingPair {
    PairKey key;
    std::array<int, 4> spots;
    std::array<double, 144> matrix;
    std::array<double, 12> convex;  // the root of the convex one
  };
  std::vector<TouchingPair> pairs_;
  Spots<double> spots_;
  std::vector<PairKey> in_pattern_;
  std::optional<PairedPattern> paired_;
  bool convex_found_ = false, symmetric_ = true, rubs_ = false, as_lu_ = false, begins_ = true;
  NewtonIteration iteration_;
  bool iteration_found_ = false;  // of the last find()
  bool iterates_ = true;          // whether it has not failed in this substep
  Factor<double> factor_;
  UnsymmetricFactor lu_;
};

}  // namespace sheetbend
