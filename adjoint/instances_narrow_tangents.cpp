// Rollouts along four directions, which experiment.cpp steps itself.
#include "core/rollout/rollout.h"
#include "core/scalar/dual.h"

namespace sheetbend {

template class Rollout<Dual<double, 4>>;

}  // namespace sheetbend
