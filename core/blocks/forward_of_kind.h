// The forward kernels of one kind's runs in a direct block, over a scalar T.
#pragma once

#include "core/blocks/wide.h"

namespace sheetbend {

template <class K, class T>
void evaluate_run(const sheetbend_blocks::Block& b, const sheetbend_blocks::Run& r) {
  for (int n = 0; n < elements<T>(r); ++n) {
    const int* rows = indices_of<T>(r.first_row, 1, n);
    const int* gradients = indices_of<T>(r.gradients, K::arity, n);
    const auto e = load_element<K, T>(b.x, r, indices_of<T>(r.nodes, K::arity, n), n);
    const Evaluation<K, Wide<T>> value(e.x, e.p);
    Wide<T> lambda[K::rows], C_r[K::rows];
    for (int j = 0; j < K::rows; ++j) {
      lambda[j] = gather(numbers_of<T>(b.lambda), rows, j);
      if (r.damped) C_r[j] = gather(numbers_of<T>(b.C_r), rows, j);
    }
    for (int j = 0; j < K::rows; ++j) {
      scatter(numbers_of<T>(b.dl), rows, j,
              -(e.residual(value.C, lambda, r.damped ? C_r : nullptr, j) * e.rates.scale));
      for (int k = 0; k < K::arity; ++k)
        store_gradient(numbers_of<T>(b.gradients), gradients + k * Pack::lanes, j, value.J + j * K::dofs + 3 * k);
    }
  }
}

template <class K, class T>
void values_of_run(const sheetbend_blocks::Values& b, const sheetbend_blocks::Run& r) {
  using W = Wide<T>;
  for (int n = 0; n < elements<T>(r); ++n) {
    const int* nodes = indices_of<T>(r.nodes, K::arity, n);
    W x[K::dofs], unused;
    for (int k = 0; k < K::arity; ++k) load_particle(numbers_of<T>(b.x), nodes + k * Pack::lanes, x + 3 * k, unused);
    const Evaluation<K, W> value(x, parameters_of<K, T>(r, n));
    for (int j = 0; j < K::rows; ++j) scatter(numbers_of<T>(b.C), indices_of<T>(r.first_row, 1, n), j, value.C[j]);
  }
}

template <class K, class T>
void refer_run(const sheetbend_blocks::References& b, const sheetbend_blocks::Run& r) {
  for (int n = 0; n < elements<T>(r); ++n) {
    const int* rows = indices_of<T>(r.first_row, 1, n);
    for (int j = 0; j < K::rows; ++j) {
      const Wide<T> now = gather(numbers_of<T>(b.C), rows, j);
      const Wide<T> before = gather(numbers_of<T>(b.C_before), rows, j);
      scatter(numbers_of<T>(b.C_r), rows, j,
              b.before == 0.0 ? now : now - Wide<T>(b.before) * difference<K>(now, before));
    }
  }
}

template <class K, class T>
constexpr sheetbend_blocks::ForwardOfKind forward_of_kind() {
  return {&evaluate_run<K, T>, &values_of_run<K, T>, &refer_run<K, T>};
}

}  // namespace sheetbend
