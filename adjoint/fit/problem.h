// The least-squares problem of a fit: all experiments, shared and private parameters, priors. One evaluation gives residuals and Jacobian;
// Ceres and SciPy only call it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "adjoint/fit/projection.h"

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
  int rows() const { return data_rows() + priors_ + corrections_; }
  const std::vector<int>& first_rows() const { return first_row_; }  // of each experiment, and one past the last

  // residual (rows), jacobian (rows x parameters, row-major) or null: rows of data, of the parameters' priors, of the corrections' priors.
  // Corrections are solved for at every u, so that all depend on u alone (projection.h). Returns false, with `failure` saying
  // why, where the physics has no answer (divergence, no equilibrium).
  bool evaluate(const double* u, double* residual, double* jacobian, Interrupt* interrupt) const;

  // Simulated markers (frames, markers, 3) of one experiment, corrected as it was in the last evaluation.
  std::vector<double> simulate(int experiment, const double* u, Interrupt* interrupt) const;

  // What the force sensors of one experiment read, likewise: (samples, 6) of one after the other.
  std::vector<double> readings(int experiment, const double* u, Interrupt* interrupt) const;

  // What `count` changes of an experiment's correction (count x its numbers) make of its residuals, (count x residuals), to first order.
  std::vector<double> respond(int experiment, const double* u, const double* changes, int count,
                              Interrupt* interrupt) const;

  // (rows) How all residuals change, to first order, once corrections have followed a change (data_rows) of the data's residuals at fixed corrections; with
  // their last linearization, after an evaluation.
  std::vector<double> reduced(const double* change) const;

  // The correction, in its units, of an experiment in the last evaluation, or as given where none is estimated.
  const std::vector<double>& correction(int experiment) const;

  // What the correction of an experiment absorbs of its data's degrees of freedom, as last linearized; 0 where none is estimated.
  double absorbed(int experiment) const;

  // Lets the next evaluation linearize the corrections where it ends, for intervals.
  void relinearize() const;

  // Lets corrections go on from where those of another problem with the same recordings ended (projection.h).
  void follow(const Problem& other) const;

  // What an evaluation depends on besides u, where corrections are estimated: they go on from where the last one ended. Empty otherwise. A
  // problem with a restored state, which must be one of its own, gives the same bits.
  std::vector<double> state() const;
  void restore(const std::vector<double>& state) const;

  std::vector<double> physical(const double* u) const;  // theta
  const std::string& failure() const { return failure_; }

 private:
  template <class T>
  void set_theta(const T* u, T* theta) const;
  // Calls f(experiment); false, with `failure`, where the physics has no answer.
  template <class F>
  bool attempt(int experiment, F&& f) const;
  template <class T>
  std::vector<T> local_theta(const T* u, int experiment) const;
  template <int N>
  void evaluate_columns(const double* u, int experiment, int first, double* residual, double* jacobian,
                        Interrupt* interrupt) const;

  // A rollout that carries `width` columns of an experiment's Jacobian, or none.
  struct Sweep {
    int experiment, first, width;
  };
  std::vector<Sweep> sweeps(bool jacobian) const;
  void project(const double* u, double* residual, double* jacobian) const;

  std::vector<Experiment> experiments_;
  std::vector<double> theta_;
  std::vector<std::vector<int>> slots_;  // per experiment: where its parameters stand in theta
  std::vector<FreeParameter> free_;
  std::vector<std::vector<int>>
      columns_;  // per experiment: the free parameters that reach it; its other columns are zero
  std::vector<int> first_row_;
  int priors_ = 0, corrections_ = 0, threads_ = 1;
  std::vector<std::unique_ptr<Projection>> projections_;  // per experiment, null where no correction is estimated
  mutable std::string failure_;
};

}  // namespace sheetbend
