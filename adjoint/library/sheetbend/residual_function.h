/// @file
/// The residuals between a recording and a scene's motion, for any optimizer.
#pragma once

#include <sheetbend/observations.h>
#include <sheetbend/scene.h>
#include <sheetbend/solver.h>

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace sheetbend::SHEETBEND_INLINE v0 {

/// How a parameter enters: as the quantity itself, or as its logarithm, which keeps it positive.
enum class Scale { linear, logarithmic };

/// A quantity that is estimated. Its name alone makes one, on a linear scale.
struct Parameter {
  std::string name;  ///< of a quantity of the scene
  Scale scale;

  Parameter(const char* name_, Scale scale_ = Scale::linear) : name(name_), scale(scale_) {}
  Parameter(std::string name_, Scale scale_ = Scale::linear) : name(std::move(name_)), scale(scale_) {}
};

/// (simulated - measured)/sigma as a function of parameters, with its exact Jacobian (tangents of the whole motion). It
/// knows no optimizer; Residuals (sheetbend/residuals.h) makes a ceres::CostFunction of it.
class SHEETBEND_API ResidualFunction {
 public:
  /// @param scene       stays alive for as long as this function
  /// @param observed    the recording
  /// @param solver      how the motion is stepped; its threads share the columns of the Jacobian, and its `memory` has
  ///                    no meaning, since tangents keep no tape
  /// @param parameters  in the order in which they enter
  /// @throws InputError  unknown parameters, a logarithm of what need not be positive, sizes that do not fit, nothing
  ///   observed.
  ResidualFunction(const Scene& scene, Observations observed, const Solver& solver, std::vector<Parameter> parameters);
  ~ResidualFunction();
  ResidualFunction(ResidualFunction&&) noexcept;
  ResidualFunction& operator=(ResidualFunction&&) noexcept;

  int rows() const;        ///< three for each marker in each frame that shows it
  int parameters() const;  ///< how many there are

  /// The scene's own values of the parameters, on their scales.
  std::vector<double> start() const;

  /// Fills residual (rows), and jacobian (rows, parameters) row by row where it is wanted.
  /// @param u         (parameters), on their scales
  /// @param residual  frame by frame, in it marker by marker, x, y and z
  /// @param jacobian  or null
  /// @return false where the physics has no answer at u: divergence, no equilibrium, a negative stiffness; `failure`
  ///   then says why.
  /// @throws InputError  u has a wrong size.
  bool evaluate(std::span<const double> u, double* residual, double* jacobian = nullptr) const;

  /// Why an evaluation gave false, the last one that did.
  std::string failure() const;

  /// The scene's values at u, one for each quantity: what a Rollout takes. @throws InputError  u has a wrong size.
  std::vector<double> values(std::span<const double> u) const;

  /// The markers as simulated at u, (frames, markers, 3) [m].
  /// @throws InputError, DivergenceError, ConvergenceError  the physics has no answer there.
  std::vector<double> simulate(std::span<const double> u) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace sheetbend::inline v0
