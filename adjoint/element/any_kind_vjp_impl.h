// Definitions of any_kind_vjp.h, included by their instances only.
#pragma once

#include <array>
#include <type_traits>

#include "adjoint/element/any_kind_vjp.h"
#include "adjoint/element/pushes_vjp.h"
#include "core/scalar/pack.h"

namespace sheetbend {
namespace any_kind_vjp {

template <class T>
struct Reverses {
  void (*values)(const T* x, const T* p, const T* C_bar, T* x_bar, T* p_bar);
  void (*pushes)(const T* x, const T* p, const T* lambda, const T* y, const T* z, T* x_bar, T* p_bar);
};

template <class T>
const Reverses<T>& reverses_of(int kind) {
  static constexpr auto all = []<class... K>(std::tuple<K...>*) {
    return std::array{Reverses<T>{values_vjp<K, T>, pushes_vjp<K, T>}...};
  }(static_cast<Registry*>(nullptr));
  return all.at(kind);
}

// One lane of packs.
template <int N>
struct Lane {
  double numbers[N];
  Lane(int lane, int count, const Pack* from) {
    for (int i = 0; i < count; ++i) numbers[i] = from[i][lane];
  }
  void store(int lane, int count, Pack* to) const {
    for (int i = 0; i < count; ++i) to[i].set(lane, numbers[i]);
  }
};

}  // namespace any_kind_vjp

// Packs go lane by lane, which has the same bits: duals of packs of every kind would be a tenth of the module.
template <class T>
void values_vjp(int kind, const T* x, const T* p, const T* C_bar, T* x_bar, T* p_bar) {
  if constexpr (std::is_same_v<T, Pack>) {
    const auto& sizes = any_kind<double>(kind);
    for (int lane = 0; lane < Pack::lanes; ++lane) {
      const any_kind_vjp::Lane<largest_kind.dofs> own_x(lane, sizes.dofs, x);
      const any_kind_vjp::Lane<largest_kind.parameters> own_p(lane, sizes.parameters, p);
      const any_kind_vjp::Lane<largest_kind.rows> own_C_bar(lane, sizes.rows, C_bar);
      any_kind_vjp::Lane<largest_kind.dofs> own_x_bar(lane, sizes.dofs, x_bar);
      any_kind_vjp::Lane<largest_kind.parameters> own_p_bar(lane, sizes.parameters, p_bar);
      values_vjp(kind, own_x.numbers, own_p.numbers, own_C_bar.numbers, own_x_bar.numbers, own_p_bar.numbers);
      own_x_bar.store(lane, sizes.dofs, x_bar);
      own_p_bar.store(lane, sizes.parameters, p_bar);
    }
  } else {
    any_kind_vjp::reverses_of<T>(kind).values(x, p, C_bar, x_bar, p_bar);
  }
}

template <class T>
void pushes_vjp(int kind, const T* x, const T* p, const T* lambda, const T* y, const T* z, T* x_bar, T* p_bar) {
  if constexpr (std::is_same_v<T, Pack>) {
    const auto& sizes = any_kind<double>(kind);
    for (int lane = 0; lane < Pack::lanes; ++lane) {
      const any_kind_vjp::Lane<largest_kind.dofs> own_x(lane, sizes.dofs, x), own_z(lane, sizes.dofs, z);
      const any_kind_vjp::Lane<largest_kind.parameters> own_p(lane, sizes.parameters, p);
      const any_kind_vjp::Lane<largest_kind.rows> own_lambda(lane, sizes.rows, lambda), own_y(lane, sizes.rows, y);
      any_kind_vjp::Lane<largest_kind.dofs> own_x_bar(lane, sizes.dofs, x_bar);
      any_kind_vjp::Lane<largest_kind.parameters> own_p_bar(lane, sizes.parameters, p_bar);
      pushes_vjp(kind, own_x.numbers, own_p.numbers, own_lambda.numbers, own_y.numbers, own_z.numbers,
                 own_x_bar.numbers, own_p_bar.numbers);
      own_x_bar.store(lane, sizes.dofs, x_bar);
      own_p_bar.store(lane, sizes.parameters, p_bar);
    }
  } else {
    any_kind_vjp::reverses_of<T>(kind).pushes(x, p, lambda, y, z, x_bar, p_bar);
  }
}

}  // namespace sheetbend
