#include "adjoint/rollout_impl.h"
#include "core/scalar/complex.h"

namespace sheetbend {

template class Rollout<Complex>;
template void rollout_states<Complex>(const Scene&, const Plan&, const Complex*, double, const std::vector<int>&,
                                      Complex*, Interrupt*);

}  // namespace sheetbend
