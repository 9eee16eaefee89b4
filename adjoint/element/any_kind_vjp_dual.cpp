#include "adjoint/element/any_kind_vjp_impl.h"
#include "core/scalar/dual.h"

namespace sheetbend {

using D = Dual<double, 1>;
template void values_vjp(int, const D*, const D*, const D*, D*, D*);
template void pushes_vjp(int, const D*, const D*, const D*, const D*, const D*, D*, D*);

}  // namespace sheetbend
