// The incremental potential of an implicit step (Kane et al. 2000), whose minimum is where the substep's forces balance:
//
//   Phi = sum |x - x~|^2/(2 w) + sum (C + g (C - C_r))^2/(2 a (1+g))         x~: predicted, w: inverse mass
//   R = dPhi/dx = (x - x~)/w - J^T lambda                                    lambda = -(C + g (C - C_r))/a
//
// R is the force that does not balance, times eta^2. Contacts add lambda_n^2/(2 kappa) to Phi and their forces to R (core/contact/law.h). Friction has no
// potential: where it acts, Phi says nothing, and what is to fall is the merit sum w |R|^2. Rows that do not give way have multipliers of their own
// (rigid_rows.h), and their residuals are part of the merit.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "core/blocks/potential_kernels.h"
#include "core/scalar/numbers.h"
#include "core/solver/block_contacts.h"
#include "core/solver/block_pairs.h"
#include "core/solver/pair_friction.h"
#include "core/solver/plan.h"
#include "core/solver/rigid_rows.h"

namespace sheetbend {

class IncrementalPotential {
 public:
  // The problem. Rows of four (particles, 4), as in sheetbend_blocks::Block, with inverse masses; values as there.
  Numbers<double> target;  // predicted, where fixed particles are at n+1
  Numbers<double> C_r;
  std::vector<Numbers<double>> values;
  BlockContacts<double> contacts;
  BlockPairs pairs;
  PairFriction<double> friction;  // of pairs
  RigidRows rigid;
  double eta = 0.0;  // of `values`; 0 where they are not filled yet
  // Per particle, fixed ones included: the length that a coordinate of one is [m]: 1 but of axes of bodies, whose coordinates have no unit. What forces
  // are judged by is of lengths.
  std::vector<double> unit;

  void resize(const Scene& scene, const DirectBlock& block);
  static std::size_t bytes(const Scene& scene, const DirectBlock& block);

  // Phi at `at`; R, three numbers per movable particle, and the following are then of there.
  double evaluate(const DirectBlock& block, Numbers<double>& at);
  // Instead, where the coordinates could not be reached: all that steps are judged by is infinite.
  double refuse() { return merit_ = forces_.left = std::numeric_limits<double>::infinity(); }
  const std::vector<double>& R() const { return R_; }
  double largest() const { return forces_.left; }  // |R| of particles
  double balance() const { return std::max(forces_.share(), torques_.share()); }
  bool balanced(double tolerance) const { return forces_.within(tolerance) && torques_.within(tolerance); }
  // Whether no more than rounding is left of the particles' forces.
  bool at_rounding() const { return forces_.left <= forces_.rounding && torques_.within(1e-10); }
  double merit() const { return merit_; }
  bool rubs() const { return rubs_; }                        // whether friction acts anywhere
  bool by_merit() const { return rubs_ || !rigid.empty(); }  // whether steps are judged by the merit
  int worst_node(const DirectBlock& block) const;

  // The constraints' runs at `at`, as the kernels take them.
  sheetbend_blocks::Potential arrays(const DirectBlock& block, Numbers<double>& at);

  RigidRows::Given given(const DirectBlock& block) { return {block, values, C_r, unit}; }
  // Adds the rigid rows' matrices to those of all members; `at` is where evaluate() looked last.
  void add_rigid_elements(const DirectBlock& block, Numbers<double>& at, std::vector<Numbers<double>>& elements) {
    if (!rigid.empty()) rigid.add_elements(given(block), at.data(), stiffness_.data(), elements);
  }

 private:
  void add_rigid_residuals();
  double add_contacts(const DirectBlock& block, const double* x);
  double add_pairs(const DirectBlock& block, const double* x);

  std::vector<sheetbend_blocks::Run> runs_;
  Numbers<double> push_, magnitude_, stiffness_;
  std::vector<double> R_;
  // The largest |R|, the largest sum of magnitudes, and what of R is rounding of the coordinates: of particles, and of directors and normals, whose
  // coordinates are lengths of one. Torques count as balanced where only rounding is left.
  struct Judged {
    double left, largest, rounding;
    double share() const { return largest > 0.0 ? left / largest : 0.0; }
    bool within(double tolerance) const { return left <= tolerance * largest; }
  };
  Judged forces_{}, torques_{};
  double merit_ = 0.0;
  std::vector<char> turns_;  // per movable particle, whether it is a director or a normal
  bool rubs_ = false;
};

}  // namespace sheetbend
