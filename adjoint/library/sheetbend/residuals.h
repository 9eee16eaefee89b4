/// @file
/// The residuals of a recording in anybody's ceres::Problem. Needs Ceres: link sheetbend::ceres.
#pragma once

#include <ceres/cost_function.h>
#include <sheetbend/residual_function.h>

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace sheetbend::SHEETBEND_INLINE v0 {

/// The residuals of one recording as a ceres::CostFunction. Each parameter is a parameter block of size 1, in the order
/// given, so that recordings, and other residuals of the same problem, share parameters by sharing blocks:
///
///     double EI = 1e-3, damping = 3e-3;
///     problem.AddResidualBlock(new sheetbend::Residuals(scene, observed, solver, {"rope_EI", "rope_bend_damping"}),
///                              nullptr, &EI, &damping);
///
/// A point without an answer (divergence, a negative stiffness) is refused, and Ceres takes a shorter step.
class Residuals : public ceres::CostFunction {
 public:
  /// Takes what ResidualFunction takes, and throws what it throws.
  Residuals(const Scene& scene, Observations observed, const Solver& solver, std::vector<Parameter> parameters)
      : function_(scene, std::move(observed), solver, std::move(parameters)) {
    mutable_parameter_block_sizes()->assign(static_cast<std::size_t>(function_.parameters()), 1);
    set_num_residuals(function_.rows());
  }

  /// The residuals, and the Jacobian's column of each block that wants it.
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const auto rows = static_cast<std::size_t>(function_.rows()),
               columns = static_cast<std::size_t>(function_.parameters());
    std::vector<double> u(columns), jacobian(jacobians ? rows * columns : 0);
    for (std::size_t k = 0; k < columns; ++k) u[k] = *parameters[k];
    if (!function_.evaluate(u, residuals, jacobians ? jacobian.data() : nullptr)) return false;
    for (std::size_t k = 0; jacobians && k < columns; ++k)
      for (std::size_t i = 0; jacobians[k] && i < rows; ++i) jacobians[k][i] = jacobian[i * columns + k];
    return true;
  }

  /// The function behind the block: where a fit starts, and what its result simulates.
  const ResidualFunction& function() const { return function_; }

 private:
  ResidualFunction function_;
};

}  // namespace sheetbend::inline v0
