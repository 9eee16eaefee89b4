// Rollouts and their derivatives for the scalars that the program uses, compiled once (instances_*.cpp).
#pragma once

#include "adjoint/rollout_vjp.h"
#include "adjoint/tape.h"

namespace sheetbend {

// Runs `steps` substeps and keeps the tape. T: double, Pack, Complex, Dual<double, 1>, Dual<double, 8>.
template <class T>
Tape<T> record_rollout(const Scene& scene, const Plan& plan, const T* inputs, double t0, int steps,
                       Interrupt* interrupt);

// Cotangents x_bar (wanted.size(), dofs) of the states at the substeps `wanted` (ascending), to inputs_bar (added). T: double, Pack, Dual<double, 1>.
template <class T>
void reverse_rollout(const Scene& scene, const Plan& plan, const T* inputs, double t0, const Tape<T>& tape,
                     const std::vector<int>& wanted, const T* x_bar, T* inputs_bar, Interrupt* interrupt);

}  // namespace sheetbend
