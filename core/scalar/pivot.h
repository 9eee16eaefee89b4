// The inverse of a pivot of LDL^T without pivoting, where a row may have nothing of its own to say.
#pragma once

#include "core/scalar/scalar.h"

namespace sheetbend {

// Of constraints' matrices J W J^T + D: a pivot below this share of its row's own diagonal is rounding. The rows before say what this one says.
inline constexpr double redundant_pivot = 1e-9;

// Zero for a pivot of at most `least` of the row's own diagonal: the row is left out, which gives it the solution zero and takes it off all other
// rows. Forward, reverse and tangents read the same inverse. A row of which nothing can move has zero for both.
template <class T>
T inverse_pivot(const T& pivot, const T& diagonal, double least = redundant_pivot) {
  const T inverse = T(1.0) / pivot;
  return select(pivot > T(least) * diagonal, inverse, T(0.0));
}

}  // namespace sheetbend
