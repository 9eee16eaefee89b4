// The motion of an experiment at one correction of its boundary, with its derivatives by that correction: the gradient of half the sum of squared
// residuals by the adjoint, and columns of their Jacobian by tangents, eight at a time. A knot moves only what comes after it, so a column's
// rollout begins there.
#pragma once

#include <optional>

#include "adjoint/experiment.h"
#include "adjoint/rollout.h"

namespace sheetbend {

class CorrectedMotion {
 public:
  // Throws as Experiment::residuals does; b has correction.count() numbers.
  CorrectedMotion(const Experiment& e, const double* theta, const double* b, Interrupt* interrupt);

  const std::vector<double>& residuals() const { return residuals_; }

  // (correction.count())
  std::vector<double> gradient(Interrupt* interrupt);

  // d residuals / d b[first + k] to columns + k * rows, for k < width <= 8. Threads may call it at the same time.
  void columns(int first, int width, double* columns, Interrupt* interrupt) const;

 private:
  int first_step(int unknown) const;

  const Experiment& e_;
  int last_;
  std::vector<double> inputs_, start_;  // as mapped, and with the equilibrium that the motion starts at
  std::vector<double> states_, residuals_;
  std::vector<std::size_t> first_row_;  // of each frame
  std::optional<Equilibrium> rest_;
  std::optional<Tape<double>> tape_;
};

}  // namespace sheetbend
