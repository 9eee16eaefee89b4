// The reverse of project_packs.
#pragma once

#include "adjoint/element/element_vjp.h"
#include "core/packs/project_packs.h"

namespace sheetbend {

template <class K, Layout layout, class Damped>
inline __attribute__((always_inline)) void project_range_vjp(const sheetbend_packs::Reverse& r, Damped damped, int begin, int end) {
  const auto gather = [&](long n)
                          __attribute__((always_inline)) { return GatheredStencil<K, layout>(r.rows_bar, r.nodes, n, true); };
  const auto reverse = [&](long n, const GatheredStencil<K, layout>& now) __attribute__((always_inline)) {
    Element<K, Pack> e;
    load_values(r.values, damped, n, e);
    const Pack* record = packs_at(r.record, n * record_size<K>);
    auto at = Kept<K, Pack>::kept(record);
    const Pack *lambda = record + Kept<K, Pack>::size, *dl = lambda + K::rows;
    Pack* lambda_bar = packs_at(r.lambda_bar, n * K::rows);
    Pack x_bar[K::dofs], w_bar[K::arity];
    ElementCotangent<K, Pack> own;
    unrolled<K::dofs>([&](int d) { x_bar[d] = now.x[d]; });
    correction_vjp(e, at, lambda, damped ? packs_at(r.C_r, n * K::rows) : nullptr, dl, lambda_bar, x_bar, w_bar, own);
    unrolled<K::dofs>([&](int d) { x_bar[d] = now.x[d] + x_bar[d]; });
    unrolled<K::arity>([&](int k) { w_bar[k] = now.w[k] + w_bar[k]; });
    const Particles<layout> particles(r.nodes, n, K::arity);
    unrolled<K::arity>([&](int k) { particles.store_row(r.rows_bar, k, x_bar + 3 * k, w_bar + k); });
    Pack* values_bar = packs_at(r.values_bar, n * (2 + parameter_count<K>));
    values_bar[0] += own.a;
    if (damped) values_bar[1] += own.g;
    for (int k = 0; k < parameter_count<K>; ++k) values_bar[2 + k] += own.p[k];
    for (int j = 0; j < K::rows; ++j) {
      lambda_bar[j] += own.lambda[j];
      if (damped) packs_at(r.C_r_bar, n * K::rows)[j] += own.C_r[j];
    }
  };
  overlapped(begin, end, gather, reverse);
}

template <class K, Layout layout>
[[SHEETBEND_FLATTEN]] void project_packs_vjp(const sheetbend_packs::Reverse& r, int begin, int end) {
  with_damped<K>(r.C_r != nullptr, [&](auto damped) { project_range_vjp<K, layout>(r, damped, begin, end); });
}

}  // namespace sheetbend
