// The reverse over complex numbers, for tests that take complex steps of gradients.
#include "adjoint/element/any_kind_vjp_impl.h"
#include "core/scalar/complex.h"

namespace sheetbend {

template void values_vjp(int, const Complex*, const Complex*, const Complex*, Complex*, Complex*);
template void pushes_vjp(int, const Complex*, const Complex*, const Complex*, const Complex*, const Complex*, Complex*,
                         Complex*);

}  // namespace sheetbend
