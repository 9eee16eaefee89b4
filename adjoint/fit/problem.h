// The least-squares problem of a fit: all experiments, shared and private parameters, priors. One evaluation gives residuals and Jacobian;
// Ceres and SciPy only call it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "adjoint/experiment.h"

namespace sheetbend {

// A free number of the fit. On a log scale the optimizer sees its logarithm. It sets every slot of theta it is tied to.
struct FreeParameter {
  std::string name;
  bool log_scale = false;
  std::vector<int> slots;
  std::vector<double> factors;  // theta[slot] = factor * value
  bool has_prior = false;
  double prior_mean = 0.0, prior_sd = 1.0;  // in the optimizer's coordinate
};

class Problem {
 public:
  Problem(std::vector<Experiment> experiments, std::vector<double> theta,
          std::vector<std::vector<int>> slots_of_experiment, std::vector<FreeParameter> free, int threads);

  int parameters() const { return static_cast<int>(free_.size()); }
  int data_rows() const { return first_row_.back(); }
  int rows() const { return data_rows() + priors_; }
  const std::vector<int>& first_rows() const { return first_row_; }  // of each experiment, and one past the last

  // residual (rows), jacobian (rows x parameters, row-major) or null. Returns false, with `failure` saying why, where the physics has no
  // answer (divergence, no equilibrium).
  bool evaluate(const double* u, double* residual, double* jacobian, Interrupt* interrupt) const;

  // Simulated markers (frames, markers, 3) of one experiment.
  std::vector<double> simulate(int experiment, const double* u, Interrupt* interrupt) const;

  std::vector<double> physical(const double* u) const;  // theta
  const std::string& failure() const { return failure_; }

 private:
  template <class T>
  void set_theta(const T* u, T* theta) const;
  template <class T>
  std::vector<T> local_theta(const std::vector<T>& theta, int experiment) const;
  template <int N>
  void evaluate_columns(const double* u, int experiment, int first, double* residual, double* jacobian,
                        Interrupt* interrupt) const;

  // A rollout that carries `width` columns of an experiment's Jacobian, or none.
  struct Sweep {
    int experiment, first, width;
  };
  std::vector<Sweep> sweeps(bool jacobian) const;

  std::vector<Experiment> experiments_;
  std::vector<double> theta_;
  std::vector<std::vector<int>> slots_;  // per experiment: where its parameters stand in theta
  std::vector<FreeParameter> free_;
  std::vector<std::vector<int>>
      columns_;  // per experiment: the free parameters that reach it; its other columns are zero
  std::vector<int> first_row_;
  int priors_ = 0, threads_ = 1;
  mutable std::string failure_;
};

}  // namespace sheetbend
