// Loops of a length known at compile time whose bodies see constants: arrays indexed by them then live in registers. Compilers unroll nested
// loops too late for that.
#pragma once

#include <utility>

namespace sheetbend {

// f(0), ..., f(N - 1).
template <int N, class F>
inline __attribute__((always_inline)) void unrolled(F&& f) {
  [&]<int... i>(std::integer_sequence<int, i...>)
      __attribute__((always_inline)) { (f(i), ...); }(std::make_integer_sequence<int, N>{});
}

}  // namespace sheetbend
