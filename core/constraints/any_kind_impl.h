// The definition of any_kind(), included by its instances only.
#pragma once

#include <array>

#include "core/constraints/any_kind.h"

namespace sheetbend {

template <class K, class T>
void values_of_kind(const T* x, const T* p, T* C) {
  T J[K::rows * K::dofs];
  K::evaluate(x, p, C, J);
}

template <class T>
const AnyKind<T>& any_kind(int kind) {
  static constexpr auto all = []<class... K>(std::tuple<K...>*) {
    return std::array{AnyKind<T>{K::rows, K::dofs, parameter_count<K>, balances<K>, evaluate_apart<K, T>,
                                 difference<K, T>, values_of_kind<K, T>}...};
  }(static_cast<Registry*>(nullptr));
  return all.at(kind);
}

}  // namespace sheetbend
