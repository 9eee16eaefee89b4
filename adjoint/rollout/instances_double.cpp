#include "adjoint/rollout/rollout_impl.h"
#include "adjoint/rollout/single_step_vjp.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

template void ProjectBlocks::forward(const Step<double>&, Work<double>&, Record<double>&);
template void SweepColors::forward(const Step<double>&, Work<double>&, Record<double>&);
template void ReverseOf<ProjectBlocks>::run(const Step<double>&, const Work<double>&, ProjectBlocks::Record<double>&,
                                            Scratch<double>&, const StepCotangents<double>&);
template void ReverseOf<SweepColors>::run(const Step<double>&, const Work<double>&, SweepColors::Record<double>&,
                                          Scratch<double>&, const StepCotangents<double>&);
template class Rollout<double>;
template void rollout_states<double>(const Scene&, const Plan&, const double*, double, const std::vector<int>&, double*,
                                     Interrupt*);
template Tape<double> record_rollout<double>(const Scene&, const Plan&, const double*, double, const std::vector<int>&,
                                             double*, int, Interrupt*);
template long reverse_rollout<double>(const Scene&, const Plan&, const double*, double, Tape<double>&,
                                      const std::vector<int>&, const double*, double*, Interrupt*);
template void single_step_vjp<double>(const Scene&, const Plan&, int, Scenes, const double*, const double*,
                                      const double*, double*, double*, double*);

}  // namespace sheetbend
