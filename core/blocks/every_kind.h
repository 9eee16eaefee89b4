// The forward kernels of every kind over a scalar for which none are compiled apart, such as a complex number.
#pragma once

#include <array>
#include <tuple>

#include "core/blocks/forward_of_kind.h"
#include "core/constraints/registry.h"

namespace sheetbend {

template <class T>
struct ForwardOfEveryKind {
  static const sheetbend_blocks::ForwardOfKind& of(int kind) { return all[kind]; }

 private:
  static constexpr auto all = []<class... K>(std::tuple<K...>*) {
    return std::array{forward_of_kind<K, T>()...};
  }(static_cast<Registry*>(nullptr));
};

}  // namespace sheetbend
