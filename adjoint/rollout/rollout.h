// Rollouts and their derivatives for the scalars that the program uses, compiled once (instances_*.cpp). States are (wanted.size(), dofs), at
// the substeps `wanted` (ascending).
#pragma once

#include <limits>

#include "adjoint/tape/tape.h"
#include "core/scalar/complex.h"
#include "core/scalar/dual.h"
#include "core/scalar/pack.h"

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

extern template void rollout_states<double>(const Scene&, const Plan&, const double*, double, const std::vector<int>&,
                                            double*, Interrupt*);
extern template void rollout_states<Pack>(const Scene&, const Plan&, const Pack*, double, const std::vector<int>&,
                                          Pack*, Interrupt*);
extern template void rollout_states<Complex>(const Scene&, const Plan&, const Complex*, double, const std::vector<int>&,
                                             Complex*, Interrupt*);
extern template void rollout_states<Dual<double, 8>>(const Scene&, const Plan&, const Dual<double, 8>*, double,
                                                     const std::vector<int>&, Dual<double, 8>*, Interrupt*);
extern template Tape<double> record_rollout<double>(const Scene&, const Plan&, const double*, double,
                                                    const std::vector<int>&, double*, int, Interrupt*);
extern template long reverse_rollout<double>(const Scene&, const Plan&, const double*, double, Tape<double>&,
                                             const std::vector<int>&, const double*, double*, Interrupt*);
extern template Tape<Pack> record_rollout<Pack>(const Scene&, const Plan&, const Pack*, double, const std::vector<int>&,
                                                Pack*, int, Interrupt*);
extern template long reverse_rollout<Pack>(const Scene&, const Plan&, const Pack*, double, Tape<Pack>&,
                                           const std::vector<int>&, const Pack*, Pack*, Interrupt*);
extern template Tape<Dual<double, 1>> record_rollout<Dual<double, 1>>(const Scene&, const Plan&, const Dual<double, 1>*,
                                                                      double, const std::vector<int>&, Dual<double, 1>*,
                                                                      int, Interrupt*);
extern template long reverse_rollout<Dual<double, 1>>(const Scene&, const Plan&, const Dual<double, 1>*, double,
                                                      Tape<Dual<double, 1>>&, const std::vector<int>&,
                                                      const Dual<double, 1>*, Dual<double, 1>*, Interrupt*);

}  // namespace sheetbend
