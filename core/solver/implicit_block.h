// A direct block whose substep is solved until its forces balance: the implicit step of BDF1 or BDF2 itself, where a projection is one
// linearized iteration of it. The coordinates of the movable particles go to a minimum of the incremental potential (Kane et al. 2000)
//
//   Phi = sum |x - x~|^2/(2 w) + sum (C + g (C - C_r))^2/(2 a (1+g))         x~: predicted, w: inverse mass
//   R = dPhi/dx = (x - x~)/w - J^T lambda                                    lambda = -(C + g (C - C_r))/a
//   K = dR/dx   = W^-1 + J^T D^-1 J - sum lambda Hess(C)                     D = a/(1+g)
//
// R is the force that does not balance, times eta^2. Newton's method with a line search. Where K is not positive definite it goes a part of the way to
// the matrix in which no constraint's share has negative eigenvalues (Teran et al. 2005; on demand: Longva et al. 2023), and a saddle, such as a
// flat sheet that is pressed in its plane, is left along a direction of negative curvature.
#pragma once

#include <stdexcept>
#include <vector>

#include "core/scalar/numbers.h"
#include "core/solver/conjugate_gradients.h"
#include "core/solver/plan.h"

namespace sheetbend {

// The forces of a substep do not balance after as many Newton matrices as it may take; or they do where K is singular, and have no derivative.
struct Unbalanced : Unconverged {
  std::string problem, fix;
  int substep = -1, node;  // node: the particle whose forces balance worst
  double time = 0.0;
  Unbalanced(const std::string& problem, const std::string& fix, int matrices, double residual, int node);
  Unbalanced(const Unbalanced& e, int substep, double time);  // the same, saying when
};

class ImplicitBlock {
 public:
  // The problem. Rows of four (particles, 4), as in sheetbend_blocks::Block, with inverse masses; values as there.
  Numbers<double> start;   // at n, fixed particles included
  Numbers<double> guess;   // at n+1 where velocities stay, likewise
  Numbers<double> target;  // predicted, where fixed particles are at n+1
  Numbers<double> C_r, diagonal;
  std::vector<Numbers<double>> values;
  double eta = 0.0;  // of `values` and `diagonal`; 0 where they are not filled yet

  void resize(const Scene& scene, const DirectBlock& block);
  static std::size_t bytes(const Scene& scene, const DirectBlock& block);

  // Throws Unbalanced. What is not a number is left for the rollout to find.
  void solve(const Scene& scene, const DirectBlock& block, const SolverOptions& options);
  const double* x() { return x_.data(); }  // the solution, rows of four

  // The largest |R| over the largest force, at the start and after each Newton step of the last solve.
  const std::vector<double>& balance() const { return balance_; }

  // K at the solution, for derivatives. Throws Unbalanced where it is not positive definite.
  void factorize(const Scene& scene, const DirectBlock& block);
  // z = K^-1 z, three numbers per movable particle; z may be over a larger scalar.
  template <class U>
  void solve(const DirectBlock& block, U* z) const {
    const CondensedPattern& pattern = pattern_of(block);
    thread_local std::vector<U> room;
    room.resize(pattern.structure.size());
    for (std::size_t p = 0; p < pattern.dof_of.size(); ++p) std::copy_n(z + 3 * p, 3, &room[pattern.dof_of[p]]);
    factor_.solve(pattern.structure, room.data());
    for (std::size_t p = 0; p < pattern.dof_of.size(); ++p) std::copy_n(&room[pattern.dof_of[p]], 3, z + 3 * p);
  }

 private:
  static const CondensedPattern& pattern_of(const DirectBlock& block) {
    return std::get<CondensedPattern>(*block.condensation);
  }
  static std::size_t element_numbers(const Scene& scene, const DirectBlock& block);

  double evaluate(const DirectBlock& block, Numbers<double>& at);
  void find_elements(const Scene& scene, const DirectBlock& block, Numbers<double>& at);
  template <class F>
  void for_each_element(const Scene& scene, const DirectBlock& block, F&& f) const;
  void find_convex_elements(const Scene& scene, const DirectBlock& block);
  bool factorize_elements(const Scene& scene, const DirectBlock& block, double convexity);
  void factorize_newton(const Scene& scene, const DirectBlock& block);
  void take_first_step(const Scene& scene, const DirectBlock& block);
  void multiply(const Scene& scene, const DirectBlock& block, const std::vector<double>& z, std::vector<double>& Kz);
  bool search_line(const DirectBlock& block);
  bool leave_saddle(const Scene& scene, const DirectBlock& block);
  bool balanced(double tolerance) const;
  bool slow() const;
  int worst_node(const DirectBlock& block) const;
  [[noreturn]] void give_up(const DirectBlock& block) const;

  std::vector<sheetbend_blocks::Run> runs_;
  Numbers<double> x_, trial_, lambda_, gradients_, dl_, no_multipliers_;
  std::vector<double> R_, d_, elements_, convex_elements_, balance_;
  Factor<double> factor_;
  double potential_ = 0.0;              // at x_
  double largest_ = 0.0, force_ = 0.0;  // |R| and the largest sum of forces, where Phi was evaluated last
  double rounding_ = 0.0;               // of R, from that of the coordinates
  double convexity_ = 0.0;  // of the last matrix: 0 for K, 1 where no constraint's share has negative eigenvalues
  int matrices_ = 0;
};

}  // namespace sheetbend
