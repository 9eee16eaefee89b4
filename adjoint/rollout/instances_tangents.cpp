#include "adjoint/rollout/rollout_impl.h"
#include "core/scalar/dual.h"

namespace sheetbend {

template void ProjectBlocks::forward(const Step<Dual<double, 8>>&, Work<Dual<double, 8>>&, Record<Dual<double, 8>>&);
template void SweepColors::forward(const Step<Dual<double, 8>>&, Work<Dual<double, 8>>&, Record<Dual<double, 8>>&);
template class Rollout<Dual<double, 8>>;
template void rollout_states<Dual<double, 8>>(const Scene&, const Plan&, const Dual<double, 8>*, double,
                                              const std::vector<int>&, Dual<double, 8>*, Interrupt*);

}  // namespace sheetbend
