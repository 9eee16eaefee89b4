// The contract of a constraint. An author writes the vector C(x) and its gradient once, over any scalar; second derivatives,
// parameter derivatives, projection, adjoint, lanes and tests follow from that.
//
//   struct Distance : OnPoints<2> {                                 the stencil: how many particles, in order
//     static constexpr const char* name = "distance";
//     static constexpr int rows = 1;                                how many scalar constraints
//     static constexpr std::array parameters{"rest_length"};        values inside C that differ per constraint
//     template <class T> static void evaluate(const T* x, const T* p, T* C, T* J);
//   };
//
// x holds the stencil's coordinates one node after the other (dofs of them), J is row-major (rows x dofs) and fully written.
// `periodic = true` says that C is an angle: differences of it (rate damping) are taken the short way round.
#pragma once

#include <array>

#include "core/scalar/vec3.h"

namespace sheetbend {

template <int Arity>
struct OnPoints {
  static constexpr int arity = Arity;
  static constexpr int dofs = 3 * Arity;
  static constexpr bool periodic = false;
};

template <class K>
inline constexpr int parameter_count = static_cast<int>(K::parameters.size());

// C and J of one constraint, on the stack.
template <class K, class T>
struct Evaluation {
  T C[K::rows];
  T J[K::rows * K::dofs];
  Evaluation(const T* x, const T* p) { K::evaluate(x, p, C, J); }
};

// a - b, for angles the short way round.
template <class K, class T>
T difference(const T& a, const T& b) {
  T d = a - b;
  if constexpr (K::periodic) {
    constexpr double turn = 6.283185307179586476925;
    d = d - T(turn) * nearest(d * T(1.0 / turn));
  }
  return d;
}

}  // namespace sheetbend
