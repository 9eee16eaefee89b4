// The reverse kernels of one kind's runs in a direct block, over a scalar T. The mathematics is element_vjp.h's.
#pragma once

#include "adjoint/element/element_vjp.h"
#include "core/blocks/wide.h"

namespace sheetbend {

template <class K, class T>
void pull_back_run(const sheetbend_blocks::Block& b, const sheetbend_blocks::Run& r) {
  using W = Wide<T>;
  for (int n = 0; n < elements<T>(r); ++n) {
    const int* rows = indices_of<T>(r.first_row, 1, n);
    const int* nodes = indices_of<T>(r.nodes, K::arity, n);
    const auto e = load_element<K, T>(b.x, r, nodes, n);
    W z[K::dofs], u[K::dofs], unused, x_bar[K::dofs]{};
    for (int k = 0; k < K::arity; ++k) {
      load_particle(numbers_of<T>(b.z), nodes + k * Pack::lanes, z + 3 * k, unused);
      load_particle(numbers_of<T>(b.u), nodes + k * Pack::lanes, u + 3 * k, unused);
    }
    W lambda[K::rows], C_r[K::rows], dl[K::rows], y[K::rows];
    for (int j = 0; j < K::rows; ++j) {
      lambda[j] = gather(numbers_of<T>(b.lambda), rows, j);
      dl[j] = gather(numbers_of<T>(b.dl), rows, j);
      y[j] = gather(numbers_of<T>(b.y), rows, j);
      if (r.damped) C_r[j] = gather(numbers_of<T>(b.C_r), rows, j);
    }
    ElementCotangent<K, W> own;
    pull_back(e, Kept<K, W>(e.x), lambda, r.damped ? C_r : nullptr, dl, y, z, u, x_bar, own);

    add_to_particles<K::arity>(numbers_of<T>(b.x_bar), nodes, r.count - n * Pack::lanes, x_bar);
    const auto add_row = [&](double* to, int j, const W& by) {
      scatter(numbers_of<T>(to), rows, j, gather(numbers_of<T>(to), rows, j) + by);
    };
    for (int j = 0; j < K::rows; ++j) {
      add_row(b.lambda_bar, j, own.lambda[j]);
      if (r.damped) add_row(b.C_r_bar, j, own.C_r[j]);
    }
    W* values_bar = numbers_of<W>(r.values_bar) + static_cast<long>(n) * (2 + parameter_count<K>);
    values_bar[0] += own.a;
    if (r.damped) values_bar[1] += own.g;
    for (int k = 0; k < parameter_count<K>; ++k) values_bar[2 + k] += own.p[k];
  }
}

// x_bar += scale J^T C_bar, p_bar += scale C_bar . dC/dp.
template <class K, class T>
void values_of_run_vjp(const sheetbend_blocks::Values& b, const sheetbend_blocks::Run& r) {
  using W = Wide<T>;
  for (int n = 0; n < elements<T>(r); ++n) {
    const int *nodes = indices_of<T>(r.nodes, K::arity, n), *rows = indices_of<T>(r.first_row, 1, n);
    W x[K::dofs], unused, scaled[K::rows], by[K::dofs]{};
    for (int k = 0; k < K::arity; ++k) load_particle(numbers_of<T>(b.x), nodes + k * Pack::lanes, x + 3 * k, unused);
    for (int j = 0; j < K::rows; ++j) scaled[j] = W(b.scale) * gather(numbers_of<T>(b.C_bar), rows, j);
    W* values_bar = numbers_of<W>(r.values_bar) + static_cast<long>(n) * (2 + parameter_count<K>);
    values_vjp<K>(x, parameters_of<K, T>(r, n), scaled, by, values_bar + 2);
    add_to_particles<K::arity>(numbers_of<T>(b.x_bar), nodes, r.count - n * Pack::lanes, by);
  }
}

template <class K, class T>
constexpr sheetbend_blocks::ReverseOfKind reverse_of_kind() {
  return {&pull_back_run<K, T>, &values_of_run_vjp<K, T>};
}

}  // namespace sheetbend
