#include "adjoint/rollout_impl.h"
#include "core/scalar/pack.h"

namespace sheetbend {

template Tape<Pack> record_rollout<Pack>(const Scene&, const Plan&, const Pack*, double, int, Interrupt*);
template void reverse_rollout<Pack>(const Scene&, const Plan&, const Pack*, double, const Tape<Pack>&,
                                    const std::vector<int>&, const Pack*, Pack*, Interrupt*);

}  // namespace sheetbend
