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
};

}  // namespace sheetbend
