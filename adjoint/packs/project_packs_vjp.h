// The reverse of project_packs.
#pragma once

#include "adjoint/element/element_vjp.h"
#include "core/packs/project_packs.h"

namespace sheetbend {

template <class K, Layout layout, class Damped>
inline __attribute__((always_inline)) void project_range_vjp(const sheetbend_packs::Reverse& r, Damped damped,
                                                             long begin, long end) {
  using Gathered = GatheredStencil<K, layout>;
  const auto gather = [&](long n) __attribute__((always_inline)) { return Gathered(r.rows_bar, r.nodes, n, true); };
  const auto reverse = [&](long n, const Gathered& now) __attribute__((always_inline)) {
    constexpr int kept = Kept<K, Register>::size, rows = K::rows;
    Element<K, Register> e;
    load_values(r.values, damped, n, e);
    const Strip record(r.record, n, record_size<K>), sums(r.lambda_bar, n, rows);
    Register numbers[kept], lambda[rows], dl[rows], lambda_bar[rows], C_r[rows], x_bar[K::dofs], w_bar[K::arity];
    unrolled<kept>([&](int i) { numbers[i] = record[i]; });
    for (int j = 0; j < rows; ++j) {
      lambda[j] = record[kept + j];
      dl[j] = record[kept + rows + j];
      lambda_bar[j] = r.fresh ? Register(0.0) : sums[j];
      if (damped) C_r[j] = Strip(r.C_r, n, rows)[j];
    }
    unrolled<K::dofs>([&](int d) { x_bar[d] = now.x[d]; });
    ElementCotangent<K, Register> own;
    correction_vjp(e, Kept<K, Register>::kept(numbers), lambda, damped ? C_r : nullptr, dl, lambda_bar, x_bar, w_bar,
                   own);
    unrolled<K::dofs>([&](int d) { x_bar[d] = now.x[d] + x_bar[d]; });
    unrolled<K::arity>([&](int k) { w_bar[k] = now.w[k] + w_bar[k]; });
    const Particles<layout> particles(r.nodes, n, K::arity);
    unrolled<K::arity>([&](int k) { particles.store(r.rows_bar, k, x_bar + 3 * k, w_bar + k); });
    const Strip values_bar(r.values_bar, n, 2 + parameter_count<K>);
    values_bar.add(0, own.a);
    if (damped) values_bar.add(1, own.g);
    for (int k = 0; k < parameter_count<K>; ++k) values_bar.add(2 + k, own.p[k]);
    for (int j = 0; j < rows; ++j) {
      sums.set(j, lambda_bar[j] + own.lambda[j]);
      if (damped) Strip(r.C_r_bar, n, rows).add(j, own.C_r[j]);
    }
  };
  for (long n = begin; n < end; ++n) reverse(n, gather(n));
}

template <class K, Layout layout>
void project_packs_vjp(const sheetbend_packs::Reverse& r, int begin, int end) {
  with_damped<K>(r.C_r != nullptr, [&](auto damped) {
    project_range_vjp<K, layout>(r, damped, places(layout, begin, r.count), places(layout, end, r.count));
  });
}

}  // namespace sheetbend
