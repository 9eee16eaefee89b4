// Rollouts along four directions, which experiment.cpp steps itself.
#include "core/rollout/rollout.h"
#include "core/scalar/dual.h"

namespace sheetbend {

template void ProjectBlocks::forward(const Step<Dual<double, 4>>&, Work<Dual<double, 4>>&, Record<Dual<double, 4>>&);
template void SweepColors::forward(const Step<Dual<double, 4>>&, Work<Dual<double, 4>>&, Record<Dual<double, 4>>&);
template class Rollout<Dual<double, 4>>;

}  // namespace sheetbend
