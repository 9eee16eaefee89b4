#include "adjoint/rollout/rollout_impl.h"
#include "core/scalar/complex.h"

namespace sheetbend {

template void ProjectBlocks::forward(const Step<Complex>&, Work<Complex>&, Record<Complex>&);
template void SweepColors::forward(const Step<Complex>&, Work<Complex>&, Record<Complex>&);
template class Rollout<Complex>;
template void rollout_states<Complex>(const Scene&, const Plan&, const Complex*, double, const std::vector<int>&,
                                      Complex*, Interrupt*);

}  // namespace sheetbend
