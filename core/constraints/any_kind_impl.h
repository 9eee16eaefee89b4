// The definition of any_kind(), included by its instances only.
#pragma once

#include <array>

#include "core/constraints/any_kind.h"

namespace sheetbend {

template <class T>
const AnyKind<T>& any_kind(int kind) {
  static constexpr auto all = []<class... K>(std::tuple<K...>*) {
    return std::array{
        AnyKind<T>{K::rows, K::dofs, parameter_count<K>, balances<K>, evaluate_apart<K, T>, difference<K, T>}...};
  }(static_cast<Registry*>(nullptr));
  return all.at(kind);
}

}  // namespace sheetbend
