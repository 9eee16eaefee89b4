// The correction b of one experiment, solved for at every theta (variable projection, Golub & Pereyra 1973). With r the residuals, b in units
// of its prior's deviation and A = dr/db,
//
//   b(theta) = argmin |r(theta, b)|^2 + |b|^2,      X = -(A^T A + 1)^-1 A^T J_theta,
//
// and the optimizer sees the residuals [r(theta, b(theta)); b(theta)] with the Jacobian [J_theta + A X; X] (Kaufman 1975). A takes many rollouts, while the
// gradient with respect to all of b takes one adjoint. So b is made stationary by the adjoint, with steps that an A of an earlier theta only guides, the gradient by
// theta is corrected to J_theta^T r, which it then is, and `relinearize` makes A exact for intervals.
#pragma once

#include <stdexcept>
#include <vector>

#include "adjoint/fit/corrected.h"

namespace sheetbend {

// No correction was found at which cost and prior balance.
struct NoCorrection : std::runtime_error {
  NoCorrection()
      : std::runtime_error(
            "what is estimated along the way (a start, the motion of driven markers) did not converge. "
            "Fix: start nearer, or fit a shorter window first") {}
};

class Projection {
 public:
  Projection(const Experiment& e, int parameters, int threads);  // parameters: of the optimizer

  int unknowns() const { return e_->correction.unknowns(); }
  const std::vector<double>& b() const { return given_; }  // all numbers, in their units

  // b(theta), and the residuals there (residual_count); u are the optimizer's parameters that make theta. Throws what the rollout throws, and
  // NoCorrection; b is then as it was.
  void solve(const std::vector<double>& theta, const double* u, double* residual, Interrupt* interrupt);

  // Turns J_theta (rows x parameters, row-major) into J_theta + A X and fills X (unknowns x parameters), where `solve` ended.
  void project(const double* u, const double* residual, double* jacobian, double* prior_jacobian);

  // What b leaves, to first order, of a change of the residuals at fixed b, and by how much b changes: [change + A x; x], x = -(A^T A + 1)^-1 A^T change.
  void reduce(double* change, double* prior_change);

  // Lets the next `solve` make A where it ends.
  void relinearize() { exact_ = true; }

  // What b absorbs of the data's degrees of freedom: the trace of A (A^T A + 1)^-1 A^T.
  double absorbed() {
    renew(nullptr);
    return unknowns() - factor_.inverse_trace();
  }

  // Goes on from where a projection of the same recording ended, such as one of the same motion with another solver: from its b, and its A guides the
  // steps until they are many. Where its numbers or residuals are others, as in another window, only those numbers follow that both begin with.
  void follow(Projection& other);

  // Everything besides u that later results depend on, appended to numbers; and a projection that goes on from there to the same bits, which
  // takes what it reads off their front. A is too large to save: only the place where it was made is, and it is made again when it is needed. But where
  // both states followed another projection, the A from there stays: to the same bits if it was the same one.
  void save(std::vector<double>& numbers) const;
  void restore(const double*& numbers);

 private:
  class Descent;
  std::size_t residuals() const { return e_->residual_count(); }
  Eigen::VectorXd predicted(const double* u) const;
  // A at (theta, b), where `here` was made.
  struct Place {
    std::vector<double> theta, b;  // b in its units
    double tolerance = 0.0;
  };
  void linearize(const Corrected& here, Place place, double damping, Interrupt* interrupt);
  void factor(double damping);
  void renew(Interrupt* interrupt);  // makes A where a restored state says that it was made

  const Experiment* e_;
  int parameters_, threads_;
  std::vector<double> given_;
  Eigen::VectorXd b_;
  bool exact_ = false, known_ = false;  // whether there is an A
  bool stale_ = false;                  // whether it is still to be made again
  bool followed_ = false;               // whether it is that of another projection
  Response A_;
  Place place_;            // of A
  ResponseFactor factor_;  // of A^T A + 1 + damping_
  double damping_ = 0.0;
  Eigen::MatrixXd X_;
  Eigen::VectorXd u_, b_there_;  // where X was made: b goes on from there along X
  Eigen::VectorXd solved_;       // u of the last solve
};

}  // namespace sheetbend
