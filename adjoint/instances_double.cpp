#include "adjoint/rollout_impl.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

template Tape<double> record_rollout<double>(const Scene&, const Plan&, const double*, double, int, Interrupt*);
template void reverse_rollout<double>(const Scene&, const Plan&, const double*, double, const Tape<double>&,
                                      const std::vector<int>&, const double*, double*, Interrupt*);

}  // namespace sheetbend
