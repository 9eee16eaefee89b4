#include "adjoint/element/any_kind_vjp_impl.h"

namespace sheetbend {

template void values_vjp(int, const double*, const double*, const double*, double*, double*);
template void values_vjp(int, const Pack*, const Pack*, const Pack*, Pack*, Pack*);
template void pushes_vjp(int, const double*, const double*, const double*, const double*, const double*, double*,
                         double*);
template void pushes_vjp(int, const Pack*, const Pack*, const Pack*, const Pack*, const Pack*, Pack*, Pack*);

}  // namespace sheetbend
