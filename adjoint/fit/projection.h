// The correction b of one experiment's boundary, solved for at every theta (variable projection, Golub & Pereyra 1973). With r the residuals, A = dr/db
// and s the prior's deviation,
//
//   b(theta) = argmin |r(theta, b)|^2 + |b/s|^2,      X = -(A^T A + s^-2)^-1 A^T J_theta,
//
// and the optimizer sees the residuals [r(theta, b(theta)); b(theta)/s] with the Jacobian [J_theta + A X; X/s] (Kaufman 1975). A takes a rollout
// for every eight numbers, while the gradient by all of them takes one adjoint. So b is made stationary by the adjoint, with steps that an A of an
// earlier theta only guides, the gradient by theta is corrected to J_theta^T r, which it then is, and `relinearize` makes A exact for intervals.
#pragma once

#include <Eigen/Cholesky>
#include <stdexcept>
#include <vector>

#include "adjoint/corrected_motion.h"

namespace sheetbend {

// No correction was found at which cost and prior balance.
struct NoCorrection : std::runtime_error {
  NoCorrection()
      : std::runtime_error(
            "the correction of driven markers did not converge. Fix: start nearer, or fit a shorter window first") {}
};

class Projection {
 public:
  // Throws std::invalid_argument where A would not fit into memory.
  Projection(const Experiment& e, int threads);

  int unknowns() const { return e_->correction.unknowns(); }
  const std::vector<double>& b() const { return b_; }

  // b(theta), and the residuals there (residual_count); u are the optimizer's parameters that make theta. Throws what the rollout throws, and
  // NoCorrection; b is then as it was.
  void solve(const double* theta, const double* u, double* residual, Interrupt* interrupt);

  // Turns J_theta (rows x parameters, row-major) into J_theta + A X and fills X/s (unknowns x parameters), where `solve` ended.
  void project(const double* u, const double* residual, double* jacobian, double* prior_jacobian, int parameters);

  // Lets the next `solve` make A where it ends.
  void relinearize() { exact_ = true; }

  // What b absorbs of the data's degrees of freedom: the trace of A (A^T A + s^-2)^-1 A^T.
  double absorbed() const;

 private:
  std::vector<double> predicted(const double* u) const;
  void linearize(const CorrectedMotion& motion, Interrupt* interrupt);

  const Experiment* e_;
  int threads_;
  double weight_;  // s^-2
  std::vector<double> b_;
  bool exact_ = false;
  Eigen::MatrixXd A_, X_;
  Eigen::VectorXd u_, b_there_;  // where X was made: b goes on from there along X
  Eigen::LLT<Eigen::MatrixXd> normal_;
};

}  // namespace sheetbend
