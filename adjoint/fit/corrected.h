// An experiment at one correction b, with the derivatives of its residuals by b.
#pragma once

#include <memory>
#include <vector>

#include "adjoint/fit/response.h"
#include "adjoint/observe/experiment.h"

namespace sheetbend {

class Corrected {
 public:
  // b has correction.count() numbers in their units. Throws as Experiment::residuals does.
  static std::unique_ptr<Corrected> at(const Experiment& e, const double* theta, const double* b, Interrupt* interrupt);
  virtual ~Corrected() = default;

  const std::vector<double>& residuals() const { return residuals_; }

  // Of half the sum of squared residuals by b.
  virtual std::vector<double> gradient(Interrupt* interrupt) = 0;

  // Of the residuals to b in units of its prior's deviation. What moves no state by more than `tolerance` sigma is left out.
  virtual Response response(double tolerance, int threads, Interrupt* interrupt) const = 0;

 protected:
  Corrected(const Experiment& e, const double* theta, const double* b)
      : e_(e), inputs_(e.inputs_at(theta, b)), residuals_(e.residual_count()) {}

  const Experiment& e_;
  std::vector<double> inputs_, residuals_;
};

}  // namespace sheetbend
