// The forward kernels of one kind's runs in a direct block, over a scalar T.
#pragma once

#include "core/blocks/wide.h"

namespace sheetbend {

template <class K, class T>
void evaluate_run(const sheetbend_blocks::Block& b, const sheetbend_blocks::Run& r) {
  for (int n = 0; n < Place<T>::count(r); ++n) {
    const Place<T> at(n);
    const int* rows = at.indices(r.first_row, 1);
    const int* gradients = at.indices(r.gradients, K::arity);
    const auto e = at.template load_element<K>(b.x, r, at.indices(r.nodes, K::arity));
    const Evaluation<K, Wide<T>> value(e.x, e.p);
    Wide<T> lambda[K::rows], C_r[K::rows];
    for (int j = 0; j < K::rows; ++j) {
      lambda[j] = at.gather(b.lambda, rows, j);
      if (r.damped) C_r[j] = at.gather(b.C_r, rows, j);
    }
    for (int j = 0; j < K::rows; ++j) {
      at.scatter(b.dl, rows, j, -(e.residual(value.C, lambda, r.damped ? C_r : nullptr, j) * e.rates.scale));
      for (int k = 0; k < K::arity; ++k)
        at.store_row(b.gradients, gradients + k * Pack::lanes, sheetbend_blocks::row * j,
                     value.J + j * K::dofs + 3 * k);
    }
  }
}

template <class K, class T>
void values_of_run(const sheetbend_blocks::Values& b, const sheetbend_blocks::Run& r) {
  for (int n = 0; n < Place<T>::count(r); ++n) {
    const Place<T> at(n);
    Wide<T> x[K::dofs], p[parameter_count<K> + 1];
    at.template load_stencil<K::arity>(b.x, at.indices(r.nodes, K::arity), x);
    at.template load_parameters<K>(r, p);
    const Evaluation<K, Wide<T>> value(x, p);
    for (int j = 0; j < K::rows; ++j) at.scatter(b.C, at.indices(r.first_row, 1), j, value.C[j]);
  }
}

template <class K, class T>
void refer_run(const sheetbend_blocks::References& b, const sheetbend_blocks::Run& r) {
  for (int n = 0; n < Place<T>::count(r); ++n) {
    const Place<T> at(n);
    const int* rows = at.indices(r.first_row, 1);
    for (int j = 0; j < K::rows; ++j) {
      const Wide<T> now = at.gather(b.C, rows, j), before = at.gather(b.C_before, rows, j);
      at.scatter(b.C_r, rows, j, b.before == 0.0 ? now : now - Wide<T>(b.before) * difference<K>(now, before));
    }
  }
}

template <class K, class T>
constexpr sheetbend_blocks::ForwardOfKind forward_of_kind() {
  return {&evaluate_run<K, T>, &values_of_run<K, T>, &refer_run<K, T>};
}

}  // namespace sheetbend
