// The compiled evaluation as a plain function, so that a module with its own runtime (Ceres) can call it without linking to it.
#pragma once

namespace sheetbend {

enum class EvaluationStatus : int { ok, no_answer, interrupted };

struct EvaluationFunction {
  static constexpr const char* capsule_name = "sheetbend.EvaluationFunction";
  const void* problem;
  int rows, parameters;
  // jacobian (row-major) may be null. no_answer: the physics has none here (divergence, no equilibrium). seconds: what the evaluation took
  // when it was made, which a journal remembers; not a number where nobody knows.
  EvaluationStatus (*call)(const void* problem, const double* u, double* residual, double* jacobian, double* seconds);
  // Whether a Jacobian is to be made with all residuals, whatever it costs: where corrections of a boundary go on from the last evaluation, what was
  // asked for decides the last digits of what comes after, and measured times must not.
  bool jacobian_along = false;
};

}  // namespace sheetbend
