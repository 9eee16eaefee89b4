#include "adjoint/rollout_impl.h"
#include "core/scalar/complex.h"

namespace sheetbend {

template Tape<Complex> record_rollout<Complex>(const Scene&, const Plan&, const Complex*, double, int, Interrupt*);

}  // namespace sheetbend
