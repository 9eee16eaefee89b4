// Loops of a length known at compile time whose bodies see constants: arrays indexed by them then live in registers. Compilers unroll nested
// loops too late for that.
#pragma once

#include <type_traits>
#include <utility>

namespace sheetbend {

// f(0), ..., f(N - 1), as constants that a body may also use in types.
template <int N, class F>
inline __attribute__((always_inline)) void unrolled(F&& f) {
  [&]<int... i>(std::integer_sequence<int, i...>) __attribute__((always_inline)) {
    (f(std::integral_constant<int, i>{}), ...);
  }(std::make_integer_sequence<int, N>{});
}

}  // namespace sheetbend
