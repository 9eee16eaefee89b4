// Rollouts along four directions, which experiment.cpp steps itself.
#include "core/scalar/dual.h"
#include "core/rollout/rollout.h"

namespace sheetbend {

template class Rollout<Dual<double, 4>>;

}  // namespace sheetbend
