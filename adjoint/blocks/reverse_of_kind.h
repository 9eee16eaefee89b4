// The reverse kernels of one kind's runs in a direct block, over a scalar T. The mathematics is element_vjp.h's.
#pragma once

#include "adjoint/element/element_vjp.h"
#include "core/blocks/wide.h"

namespace sheetbend {

template <class K, class T>
void pull_back_run(const sheetbend_blocks::Block& b, const sheetbend_blocks::Run& r) {
  using W = Wide<T>;
  for (int n = 0; n < Place<T>::count(r); ++n) {
    const Place<T> at(n);
    const int *rows = at.indices(r.first_row, 1), *nodes = at.indices(r.nodes, K::arity);
    const auto e = at.template load_element<K>(b.x, r, nodes);
    W z[K::dofs], u[K::dofs], x_bar[K::dofs]{};
    at.template load_stencil<K::arity>(b.z, nodes, z);
    at.template load_stencil<K::arity>(b.u, nodes, u);
    W lambda[K::rows], C_r[K::rows], dl[K::rows], y[K::rows];
    for (int j = 0; j < K::rows; ++j) {
      lambda[j] = at.gather(b.lambda, rows, j);
      dl[j] = at.gather(b.dl, rows, j);
      y[j] = at.gather(b.y, rows, j);
      if (r.damped) C_r[j] = at.gather(b.C_r, rows, j);
    }
    ElementCotangent<K, W> own;
    pull_back(e, Kept<K, W>(e.x), lambda, r.damped ? C_r : nullptr, dl, y, z, u, x_bar, own);

    at.template add_to_stencil<K::arity>(b.x_bar, nodes, r, x_bar);
    const auto add_row = [&](double* to, int j, const W& by) { at.scatter(to, rows, j, at.gather(to, rows, j) + by); };
    for (int j = 0; j < K::rows; ++j) {
      add_row(b.lambda_bar, j, own.lambda[j]);
      if (r.damped) add_row(b.C_r_bar, j, own.C_r[j]);
    }
    const auto value_bar = [&](int i) -> W& { return at.value(r.values_bar, 2 + parameter_count<K>, i); };
    value_bar(0) += own.a;
    if (r.damped) value_bar(1) += own.g;
    for (int k = 0; k < parameter_count<K>; ++k) value_bar(2 + k) += own.p[k];
  }
}

// x_bar += scale J^T C_bar, p_bar += scale C_bar . dC/dp.
template <class K, class T>
void values_of_run_vjp(const sheetbend_blocks::Values& b, const sheetbend_blocks::Run& r) {
  using W = Wide<T>;
  constexpr int parameters = parameter_count<K>;
  for (int n = 0; n < Place<T>::count(r); ++n) {
    const Place<T> at(n);
    const int *nodes = at.indices(r.nodes, K::arity), *rows = at.indices(r.first_row, 1);
    W x[K::dofs], p[parameters + 1], scaled[K::rows], x_bar[K::dofs]{}, p_bar[parameters + 1];
    at.template load_stencil<K::arity>(b.x, nodes, x);
    at.template load_parameters<K>(r, p);
    for (int j = 0; j < K::rows; ++j) scaled[j] = W(b.scale) * at.gather(b.C_bar, rows, j);
    for (int k = 0; k < parameters; ++k) p_bar[k] = at.value(r.values_bar, 2 + parameters, 2 + k);
    values_vjp<K>(x, p, scaled, x_bar, p_bar);
    for (int k = 0; k < parameters; ++k) at.value(r.values_bar, 2 + parameters, 2 + k) = p_bar[k];
    at.template add_to_stencil<K::arity>(b.x_bar, nodes, r, x_bar);
  }
}

template <class K, class T>
constexpr sheetbend_blocks::ReverseOfKind reverse_of_kind() {
  return {&pull_back_run<K, T>, &values_of_run_vjp<K, T>};
}

}  // namespace sheetbend
