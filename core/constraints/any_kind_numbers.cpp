#include "core/constraints/any_kind_impl.h"
#include "core/scalar/complex.h"
#include "core/scalar/pack.h"

namespace sheetbend {

template const AnyKind<double>& any_kind(int);
template const AnyKind<Pack>& any_kind(int);
template const AnyKind<Complex>& any_kind(int);

}  // namespace sheetbend
