// The same constraint without its shortcuts (concept.h), and one whose second derivatives are wrong by one part in a million, and in nothing else: the ladder
// must flag it.
#pragma once

#include "core/scalar/dual.h"

namespace sheetbend::testing {

template <class K>
struct WithoutShortcuts : K {
  static constexpr bool unit_gradients = false;
  template <class T>
  struct Geometry;  // hides the constraint's own
  static void reverse() = delete;
};

template <class K>
struct Mutant : WithoutShortcuts<K> {
  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    K::evaluate(x, p, C, J);
  }
  // On duals the first `rows` directions are those of the coordinates; directions of parameters come after
  // them and stay right.
  template <class T, int N>
  static void evaluate(const Dual<T, N>* x, const Dual<T, N>* p, Dual<T, N>* C, Dual<T, N>* J) {
    K::evaluate(x, p, C, J);
    for (int i = 0; i < K::rows * K::dofs; ++i)
      for (int direction = 0; direction < std::min(N, K::rows); ++direction)
        J[i].d[direction] = J[i].d[direction] * T(1.0 + 1e-6);
  }
};

}  // namespace sheetbend::testing
