// The reverse kernels of every kind over a scalar for which none are compiled apart.
#pragma once

#include <array>
#include <tuple>

#include "adjoint/blocks/reverse_of_kind.h"
#include "core/constraints/registry.h"

namespace sheetbend {

template <class T>
struct ReverseOfEveryKind {
  static const sheetbend_blocks::ReverseOfKind& of(int kind) { return all[kind]; }

 private:
  static constexpr auto all = []<class... K>(std::tuple<K...>*) {
    return std::array{reverse_of_kind<K, T>()...};
  }(static_cast<Registry*>(nullptr));
};

}  // namespace sheetbend
