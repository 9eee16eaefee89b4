// Where cotangents go.
#pragma once

namespace sheetbend {

// Cotangents of the states at n and n-1, accumulated.
template <class T>
struct StateCotangents {
  T *x, *x_before, *v, *v_before;
};

// One number per node, `stride` apart.
template <class T>
struct Strided {
  T* data;
  int stride;
  T& of(int node) const { return data[static_cast<long>(stride) * node]; }
};

}  // namespace sheetbend
