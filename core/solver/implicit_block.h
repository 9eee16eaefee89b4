// A direct block whose substep is solved until its forces balance: the implicit step of BDF1 or BDF2 itself, where a projection is one
// linearized iteration of it. The coordinates of the movable particles go to a minimum of the incremental potential by Newton's method
// with a line search. A saddle, such as a flat sheet that is pressed in its plane, is left along a direction of negative curvature. Where friction acts
// there is no potential: the same Newton method with the whole unsymmetric matrix goes down in the merit sum w |R|^2, for which its steps always are a
// direction of descent. The same holds where rows do not give way, whose multipliers are unknowns beside the coordinates (rigid_rows.h). Frames of rods stay settled (block_frames.h).
#pragma once

#include <type_traits>
#include <vector>

#include "core/linear/conjugate_gradients.h"
#include "core/solver/block_frames.h"
#include "core/solver/newton_matrix.h"
#include "core/solver/unbalanced.h"

namespace sheetbend {

class ImplicitBlock {
 public:
  static constexpr int most_halvings = 60;  // of a step

  IncrementalPotential potential;  // the problem
  // Rows of four (particles, 4), as in sheetbend_blocks::Block, with inverse masses.
  Numbers<double> start;  // at n, fixed particles included
  Numbers<double> guess;  // at n+1 where velocities stay, likewise

  void resize(const Scene& scene, const DirectBlock& block);
  static std::size_t bytes(const Scene& scene, const DirectBlock& block);

  // Throws Unbalanced. What is not a number is left for the rollout to find.
  void solve(const Scene& scene, const DirectBlock& block, const SolverOptions& options);
  // The movable particles' guess is the solution, found before.
  void take_guess(const DirectBlock& block);
  const double* x() { return x_.data(); }                     // the solution, rows of four
  const RigidRows& rigid() const { return potential.rigid; }  // with the solution's multipliers

  // Whether a pair touches in the end that did not at n.
  bool pair_begins() { return potential.pairs.begins(start, x_); }

  // The largest |R| over the largest force, at the start and after each Newton step of the last solve.
  const std::vector<double>& balance() const { return balance_; }

  // K at the solution, for derivatives: with the curvature of colliders. Throws Unbalanced where it is not positive definite, or has no inverse
  // where friction acts.
  void factorize(const Scene& scene, const DirectBlock& block);
  // The same for transposed solves of plain numbers, which another pass refines: not factored where iterations are less work.
  void prepare_transposed(const Scene& scene, const DirectBlock& block);
  // z = K^-1 z or K^-T z, three numbers per movable particle; z may be over a larger scalar. With rigid rows [z; mu] is that of the whole matrix (rigid_rows.h),
  // and Unbalanced is thrown where it has no digits.
  template <class U>
  void solve(const DirectBlock& block, U* z, U* mu) const {
    if (rigid().empty()) return matrix_.solve(block, z);
    expect_digits(block, rigid().solve(block, z, mu, [&](U* dz) { matrix_.solve(block, dz); }, all_digits));
  }
  template <class U>
  void solve_transposed(const Scene& scene, const DirectBlock& block, U* z, U* mu) {
    if constexpr (std::is_same_v<U, double>)
      if (!factored_ && matrix_.iterate(scene, block, refined_digits, true, z)) return;
    if (!factored_) factorize_solution(scene, block);
    if (rigid().empty()) return matrix_.solve_transposed(block, z);
    expect_digits(block, rigid().solve(block, z, mu, [&](U* dz) { matrix_.solve_transposed(block, dz); }, all_digits));
  }

 private:
  void begin();
  bool find_balance(const Scene& scene, const DirectBlock& block, const SolverOptions& options);
  bool raise_friction(const Scene& scene, const DirectBlock& block, const SolverOptions& options);
  static constexpr double all_digits = 1e-15,
                          enough_digits = 1e-8;   // of multipliers, for derivatives and for Newton steps
  static constexpr double refined_digits = 1e-9;  // of iterations that another pass refines
  static constexpr double sufficient = 1e-4;      // share of the slope's promise that a step has to keep (Armijo)
  void expect_digits(const DirectBlock& block, double share) const;
  void expect_none_passes(const DirectBlock& block, Numbers<double>& from, Numbers<double>& to) const;
  double look(const DirectBlock& block);
  double look(const DirectBlock& block, double t);
  double step_tolerance() const;
  void find_step(const Scene& scene, const DirectBlock& block);
  void take_first_step(const Scene& scene, const DirectBlock& block);
  void find_matrix(const Scene& scene, const DirectBlock& block);
  void factorize_newton(const Scene& scene, const DirectBlock& block);
  void factorize_solution(const Scene& scene, const DirectBlock& block);
  void take_direction(const Scene& scene, const DirectBlock& block);
  bool search_line(const DirectBlock& block, int most_trials);
  bool step_over_kinks(const Scene& scene, const DirectBlock& block, int most_matrices);
  bool go_down(const Scene& scene, const DirectBlock& block, int most_matrices);
  bool search_where_it_rubs(const Scene& scene, const DirectBlock& block);
  void accept(double phi);
  bool leave_saddle(const Scene& scene, const DirectBlock& block);
  double curvature(const DirectBlock& block);
  bool descend(const DirectBlock& block, double curvature);
  bool balanced(double tolerance) const;
  bool slow() const;
  [[noreturn]] void give_up(const DirectBlock& block) const;

  NewtonMatrix matrix_;
  Numbers<double> x_, trial_, z_, Kz_;
  std::vector<double> d_, balance_;
  std::vector<double> firm_;         // of the contacts: how firm they are in the end
  std::vector<double> lambda_, dl_;  // of the rigid rows at x_, and their step
  double phi_ = 0.0, merit_ = 0.0;   // at x_
  bool by_merit_ = false;            // likewise, whether steps are judged by the merit
  double convexity_ = 0.0;  // of the last matrix: 0 for K, 1 where no constraint's share has negative eigenvalues
  int matrices_ = 0;
  bool factored_ = false;  // the last matrix; where it is not, iterations are tried first
  std::size_t first_ = 0;  // of balance_ since Newton's method began, for the last time
};

}  // namespace sheetbend
