#include "adjoint/rollout_impl.h"
#include "core/scalar/dual.h"

namespace sheetbend {

template class Rollout<Dual<double, 1>>;
template Tape<Dual<double, 1>> record_rollout<Dual<double, 1>>(const Scene&, const Plan&, const Dual<double, 1>*,
                                                               double, const std::vector<int>&, Dual<double, 1>*, int,
                                                               Interrupt*);
template long reverse_rollout<Dual<double, 1>>(const Scene&, const Plan&, const Dual<double, 1>*, double,
                                               Tape<Dual<double, 1>>&, const std::vector<int>&, const Dual<double, 1>*,
                                               Dual<double, 1>*, Interrupt*);

}  // namespace sheetbend
