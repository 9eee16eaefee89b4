#include "adjoint/solver/block_pairs_vjp.h"

namespace sheetbend {

template PairNumbers<double> meet_vjp(bool, Part, const double*, const PairNumbers<double>&, const double*, double*,
                                      double*);
template PairNumbers<double> rub_vjp(bool, Part, const double*, const PairNumbers<double>&, const Rub<double>&,
                                     const double*, const Vec3<double>&, double*, double*, Rub<double>&);

}  // namespace sheetbend
