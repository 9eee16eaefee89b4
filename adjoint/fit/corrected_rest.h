// An equilibrium at one correction.
#pragma once

#include <optional>

#include "adjoint/equilibrium/equilibrium_vjp.h"
#include "adjoint/fit/corrected.h"

namespace sheetbend {

class CorrectedRest : public Corrected {
 public:
  CorrectedRest(const Experiment& e, const double* theta, const double* b, Interrupt* interrupt);

  std::vector<double> gradient(Interrupt* interrupt) override;
  Response response(double tolerance, int threads, Interrupt* interrupt) const override;

 private:
  const double* offsets() const { return &inputs_[e_.scene->layout.total()]; }

  std::vector<double> x_;
  std::optional<EquilibriumDerivative> derivative_;
};

}  // namespace sheetbend
