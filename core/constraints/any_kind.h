// A constraint whose kind is a number: C, J and J^T lambda. Code that calls with_kind() is compiled once per kind; code that comes here is compiled once.
// For code where the kind decides little of the time. What it calls is compiled once per kind and scalar (any_kind_*.cpp), whoever asks for it.
#pragma once

#include <algorithm>
#include <tuple>

#include "core/constraints/registry.h"

namespace sheetbend {

// The largest sizes of any kind: arrays of these have room for every one.
struct KindSizes {
  int rows, dofs, gradient, parameters;
};
inline constexpr KindSizes largest_kind = []<class... K>(std::tuple<K...>*) {
  return KindSizes{std::max({K::rows...}), std::max({K::dofs...}), std::max({K::rows * K::dofs...}),
                   std::max({parameter_count<K>...})};
}(static_cast<Registry*>(nullptr));

// What is known of a kind by its number.
template <class T>
struct AnyKind {
  int rows, dofs, parameters;
  bool balances;
  void (*evaluate)(const T* x, const T* p, T* C, T* J);
  T (*difference)(const T& a, const T& b);
  void (*values)(const T* x, const T* p, T* C);  // C alone
};

// For the scalars of any_kind_*.cpp; other scalars include any_kind_impl.h.
template <class T>
const AnyKind<T>& any_kind(int kind);

// out = J^T y.
template <class T>
void transpose_times(int rows, int dofs, const T* J, const T* y, T* out) {
  for (int d = 0; d < dofs; ++d) out[d] = J[d] * y[0];
  for (int j = 1; j < rows; ++j)
    for (int d = 0; d < dofs; ++d) out[d] += J[j * dofs + d] * y[j];
}

// Room for one constraint after the other.
template <class T>
struct AnyConstraint {
  const AnyKind<T>* kind = nullptr;
  T x[largest_kind.dofs], C[largest_kind.rows], J[largest_kind.gradient], push[largest_kind.dofs];

  // Sets C and J at x.
  void evaluate(int number, const T* p) {
    kind = &any_kind<T>(number);
    kind->evaluate(x, p, C, J);
  }

  // Sets push to J^T lambda.
  void set_push(const T* lambda) { transpose_times(kind->rows, kind->dofs, J, lambda, push); }
};

}  // namespace sheetbend
