#include "adjoint/rollout/rollout_impl.h"
#include "adjoint/rollout/single_step_vjp.h"
#include "core/scalar/pack.h"

namespace sheetbend {

template void ProjectBlocks::forward(const Step<Pack>&, Work<Pack>&, Record<Pack>&);
template void SweepColors::forward(const Step<Pack>&, Work<Pack>&, Record<Pack>&);
template void ReverseOf<ProjectBlocks>::run(const Step<Pack>&, const Work<Pack>&, ProjectBlocks::Record<Pack>&,
                                            Scratch<Pack>&, const StepCotangents<Pack>&);
template void ReverseOf<SweepColors>::run(const Step<Pack>&, const Work<Pack>&, SweepColors::Record<Pack>&,
                                          Scratch<Pack>&, const StepCotangents<Pack>&);
template class Rollout<Pack>;
template void rollout_states<Pack>(const Scene&, const Plan&, const Pack*, double, const std::vector<int>&, Pack*,
                                   Interrupt*);
template Tape<Pack> record_rollout<Pack>(const Scene&, const Plan&, const Pack*, double, const std::vector<int>&, Pack*,
                                         int, Interrupt*);
template long reverse_rollout<Pack>(const Scene&, const Plan&, const Pack*, double, Tape<Pack>&,
                                    const std::vector<int>&, const Pack*, Pack*, Interrupt*);
template void single_step_vjp<Pack>(const Scene&, const Plan&, int, Scenes, const Pack*, const Pack*, const Pack*,
                                    Pack*, Pack*, Pack*);

}  // namespace sheetbend
