// Where cotangents go.
#pragma once

namespace sheetbend {

// Cotangents of the states at n and n-1, accumulated.
template <class T>
struct StateCotangents {
  T *x, *x_before, *v, *v_before;
};

}  // namespace sheetbend
