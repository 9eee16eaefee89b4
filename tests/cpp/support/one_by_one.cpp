#include "tests/cpp/support/one_by_one.h"

namespace sheetbend {

template void project_color(const SubstepState<double>&, const SolverOptions&, const Color&, IterationRecord<double>&);
template void project_color_vjp(const SubstepState<double>&, const SolverOptions&, const Color&,
                                const IterationRecord<double>&, const SubstepCotangent<double>&);

}  // namespace sheetbend
