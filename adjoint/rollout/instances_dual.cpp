#include "adjoint/rollout/rollout_impl.h"
#include "core/scalar/dual.h"

namespace sheetbend {

template void ProjectBlocks::forward(const Step<Dual<double, 1>>&, Work<Dual<double, 1>>&, Record<Dual<double, 1>>&);
template void SweepColors::forward(const Step<Dual<double, 1>>&, Work<Dual<double, 1>>&, Record<Dual<double, 1>>&);
template void ReverseOf<ProjectBlocks>::run(const Step<Dual<double, 1>>&, const Work<Dual<double, 1>>&,
                                            ProjectBlocks::Record<Dual<double, 1>>&, Scratch<Dual<double, 1>>&,
                                            const StepCotangents<Dual<double, 1>>&);
template void ReverseOf<SweepColors>::run(const Step<Dual<double, 1>>&, const Work<Dual<double, 1>>&,
                                          SweepColors::Record<Dual<double, 1>>&, Scratch<Dual<double, 1>>&,
                                          const StepCotangents<Dual<double, 1>>&);
template class Rollout<Dual<double, 1>>;
template Tape<Dual<double, 1>> record_rollout<Dual<double, 1>>(const Scene&, const Plan&, const Dual<double, 1>*,
                                                               double, const std::vector<int>&, Dual<double, 1>*, int,
                                                               Interrupt*);
template long reverse_rollout<Dual<double, 1>>(const Scene&, const Plan&, const Dual<double, 1>*, double,
                                               Tape<Dual<double, 1>>&, const std::vector<int>&, const Dual<double, 1>*,
                                               Dual<double, 1>*, Interrupt*);

}  // namespace sheetbend
