// Rollouts and their derivatives for the scalars that the program uses, compiled once (instances_*.cpp). States are (wanted.size(), dofs), at
// the substeps `wanted` (ascending).
#pragma once

#include <limits>

#include "adjoint/tape.h"

namespace sheetbend {

inline constexpr int every_state = std::numeric_limits<int>::max();

// The states alone. T: double, Pack, Complex, Dual<double, 8>.
template <class T>
void rollout_states(const Scene& scene, const Plan& plan, const T* inputs, double t0, const std::vector<int>& wanted,
                    T* states, Interrupt* interrupt);

// The same, and a tape of at most `kept` states up to the last one wanted. T: double, Pack, Dual<double, 1>.
template <class T>
Tape<T> record_rollout(const Scene& scene, const Plan& plan, const T* inputs, double t0, const std::vector<int>& wanted,
                       T* states, int kept, Interrupt* interrupt);

// Cotangents x_bar of the wanted states to inputs_bar (added). The tape serves for any number of reverses, from any number of threads; what was
// dropped from it is computed again, one reverse after the other. Returns the substeps that were computed again. T: double, Pack, Dual<double, 1>.
template <class T>
long reverse_rollout(const Scene& scene, const Plan& plan, const T* inputs, double t0, Tape<T>& tape,
                     const std::vector<int>& wanted, const T* x_bar, T* inputs_bar, Interrupt* interrupt);

}  // namespace sheetbend
