// Levenberg-Marquardt by Ceres on a Problem. In a module of its own: Debian's Ceres brings OpenMP, which must not load before it is asked for.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "adjoint/fit/evaluation.h"

namespace sheetbend {

struct CeresOptions {
  int max_iterations = 200;
  double function_tolerance = 1e-12, gradient_tolerance = 1e-12, parameter_tolerance = 1e-12;
  std::vector<double> longest_step;  // of each parameter; infinite where there is none
  std::vector<int> held;             // parameters that stay, in order; not all of them
  double residual_seconds = 0.0;     // [s] that the caller took for residuals alone; 0: unknown
};

struct CeresProgress {
  int iteration;
  double cost, step_norm, gradient_max;
};

struct CeresResult {
  std::vector<double> u;
  double cost = 0.0;
  int iterations = 0, evaluations = 0, jacobians = 0;
  bool converged = false, stopped = false;  // stopped: by Ctrl-C or by the observer
  std::string message;
  // At u, (rows) and (rows, parameters); empty where the last Jacobian was made elsewhere.
  std::vector<double> residual, jacobian;
};

// Called after every iteration with the current point; returning false ends the fit with its best so far.
using Observe = std::function<bool(const CeresProgress&, const std::vector<double>& u)>;

CeresResult minimize_with_ceres(const EvaluationFunction& evaluation, std::vector<double> u,
                                const std::vector<double>& lower, const std::vector<double>& upper,
                                const CeresOptions& options, const Observe& observe);

}  // namespace sheetbend
