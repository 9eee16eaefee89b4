#include "adjoint/rollout_impl.h"
#include "core/scalar/dual.h"

namespace sheetbend {

template Tape<Dual<double, 8>> record_rollout<Dual<double, 8>>(const Scene&, const Plan&, const Dual<double, 8>*,
                                                               double, int, Interrupt*);

}  // namespace sheetbend
