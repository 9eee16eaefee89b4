// The kernels of every kind by its number, for the tables of an instruction set. Kinds that are not hot may have none of this set: where
// SHEETBEND_COLD_VARIANT names another one, the tables take theirs. Kernels of all sets take the same arrays and have the same bits.
#pragma once

#include <array>
#include <cstddef>
#include <tuple>
#include <utility>

#include "core/constraints/registry.h"

#define SHEETBEND_JOIN_(a, b) a##b
#define SHEETBEND_JOIN(a, b) SHEETBEND_JOIN_(a, b)

namespace sheetbend {

template <class Kernels>
using KernelsByNumber = std::array<const Kernels*, kind_count>;

// `of_cold_kinds` are those of kinds that are not hot; null where these have kernels of their own.
template <template <class> class Own, class Kernels>
constexpr KernelsByNumber<Kernels> kernels_by_number([[maybe_unused]] const Kernels* const* of_cold_kinds = nullptr) {
  const auto choose = [&of_cold_kinds]<class K>(K*, [[maybe_unused]] std::size_t kind) -> const Kernels* {
#ifdef SHEETBEND_COLD_VARIANT
    if constexpr (!Own<K>::hot) return of_cold_kinds[kind];
#endif
    return &Own<K>::all;
  };
  return [&]<class... K, std::size_t... kind>(std::tuple<K...>*, std::index_sequence<kind...>) {
    return KernelsByNumber<Kernels>{choose(static_cast<K*>(nullptr), kind)...};
  }(static_cast<Registry*>(nullptr), std::make_index_sequence<kind_count>());
}

// Those of kinds that are not hot, null for the others.
template <template <class> class Own, class Kernels>
constexpr KernelsByNumber<Kernels> cold_kernels_by_number() {
  const auto choose = []<class K>(K*) -> const Kernels* {
    if constexpr (Own<K>::hot)
      return nullptr;
    else
      return &Own<K>::all;
  };
  return [&]<class... K>(std::tuple<K...>*) {
    return KernelsByNumber<Kernels>{choose(static_cast<K*>(nullptr))...};
  }(static_cast<Registry*>(nullptr));
}

}  // namespace sheetbend
