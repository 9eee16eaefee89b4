// The reverse of project_packs: eight constraints of one color at a time.
#pragma once

#include "adjoint/element/element_vjp.h"
#include "core/packs/project_packs.h"

namespace sheetbend {

template <class K>
[[SHEETBEND_FLATTEN]] void project_packs_vjp(const sheetbend_packs::Reverse& r, int begin, int end) {
  using sheetbend_packs::lanes;
  const bool damped = r.C_r != nullptr;
  for (long n = begin; n < end; ++n) {
    const int* nodes = r.nodes + n * K::arity * lanes;
    Element<K, Pack> e;
    Pack x_bar[K::dofs], node_w_bar[K::arity], w_bar[K::arity], lambda[K::rows], dl[K::rows], C_r[K::rows],
        lambda_bar[K::rows];
    for (int k = 0; k < K::arity; ++k) {
      Pack ignored[3];
      load_rows(r.rows, nodes + k * lanes, ignored[0], ignored[1], ignored[2], e.w[k]);
      load_rows(r.rows_bar, nodes + k * lanes, x_bar[3 * k], x_bar[3 * k + 1], x_bar[3 * k + 2], node_w_bar[k]);
    }
    load_values(r.values + n * value_count<K>(damped) * lanes, damped, e);
    const double* record = r.record + n * record_size<K> * lanes;
    for (int d = 0; d < K::dofs; ++d) e.x[d] = load(record + d * lanes);
    for (int j = 0; j < K::rows; ++j) {
      lambda[j] = load(record + (K::dofs + j) * lanes);
      dl[j] = load(record + (K::dofs + K::rows + j) * lanes);
      lambda_bar[j] = load(r.lambda_bar + (n * K::rows + j) * lanes);
      if (damped) C_r[j] = load(r.C_r + (n * K::rows + j) * lanes);
    }
    ElementCotangent<K, Pack> own;
    Pack incoming[K::dofs];
    for (int d = 0; d < K::dofs; ++d) incoming[d] = x_bar[d];
    correction_vjp(e, lambda, damped ? C_r : nullptr, dl, lambda_bar, x_bar, w_bar, own);
    for (int k = 0; k < K::arity; ++k)
      store_rows(r.rows_bar, nodes + k * lanes, incoming[3 * k] + x_bar[3 * k], incoming[3 * k + 1] + x_bar[3 * k + 1],
                 incoming[3 * k + 2] + x_bar[3 * k + 2], node_w_bar[k] + w_bar[k]);
    const auto add = [](double* to, const Pack& by) { store(to, load(to) + by); };
    double* values_bar = r.values_bar + n * (2 + parameter_count<K>)*lanes;
    add(values_bar, own.a);
    if (damped) add(values_bar + lanes, own.g);
    for (int k = 0; k < parameter_count<K>; ++k) add(values_bar + (2 + k) * lanes, own.p[k]);
    for (int j = 0; j < K::rows; ++j) {
      store(r.lambda_bar + (n * K::rows + j) * lanes, lambda_bar[j] + own.lambda[j]);
      if (damped) add(r.C_r_bar + (n * K::rows + j) * lanes, own.C_r[j]);
    }
  }
}

}  // namespace sheetbend
