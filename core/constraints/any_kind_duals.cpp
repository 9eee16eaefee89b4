#include "core/constraints/any_kind_impl.h"
#include "core/scalar/dual.h"

namespace sheetbend {

template const AnyKind<Dual<double, 1>>& any_kind(int);
template const AnyKind<Dual<double, 4>>& any_kind(int);
template const AnyKind<Dual<double, 8>>& any_kind(int);

}  // namespace sheetbend
