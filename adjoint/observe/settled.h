// Places at the start that come from numbers, such as those of an estimated start, break rigid links by a little, and the first substep would throw
// particles back with a velocity of the error over its length. Such a motion starts where a very short substep from rest leaves them: there is time for
// rigid links to hold, and for nothing else: what contacts carry, and what has slid, stays as it is given.
#pragma once

#include <vector>

#include "adjoint/rollout/rollout.h"

namespace sheetbend {

// That substep of a solver with these options.
Plan settling_plan(const Scene& scene, SolverOptions options);

// Coordinates (dofs). Throws what a rollout throws. T: double, Dual<double, 4>, Dual<double, 8>.
template <class T>
std::vector<T> settled_coordinates(const Scene& scene, const Plan& settling, const T* inputs, double t0);

// The same with its derivative.
class Settled {
 public:
  Settled(const Scene& scene, const Plan& settling, const double* inputs, double t0);

  const std::vector<double>& x() const { return x_; }
  // inputs_bar += the transpose of the derivative times x_bar.
  void pull_back(const double* x_bar, double* inputs_bar);

 private:
  const Scene& scene_;
  const Plan& settling_;
  double t0_;
  std::vector<double> still_, x_;
  Tape<double> tape_;
};

}  // namespace sheetbend
