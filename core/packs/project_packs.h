// The projection of eight constraints of one color at a time. The lanes of a short last pack repeat its last constraint: they compute
// and store the same numbers.
#pragma once

#include "core/element/element.h"
#include "core/packs/kernels.h"
#include "core/packs/lanes.h"

namespace sheetbend {

template <class K>
inline constexpr int record_size = sheetbend_packs::record_size(K::dofs, K::rows);

template <class K>
constexpr int value_count(bool damped) {
  return sheetbend_packs::value_count(damped, parameter_count<K>);
}

template <class K>
void load_values(const double* values, bool damped, Element<K, Pack>& e) {
  constexpr int lanes = sheetbend_packs::lanes;
  e.rates.a = load(values);
  if (damped) {
    e.rates.g = load(values + lanes);
    e.rates.scale = load(values + 2 * lanes);
  }
  for (int k = 0; k < parameter_count<K>; ++k)
    e.p[k] = load(values + (sheetbend_packs::value_count(damped, 0) + k) * lanes);
}

template <class K>
[[SHEETBEND_FLATTEN]] void project_packs(const sheetbend_packs::Forward& f, int begin, int end) {
  using sheetbend_packs::lanes;
  const bool damped = f.C_r != nullptr;
  for (long n = begin; n < end; ++n) {
    const int* nodes = f.nodes + n * K::arity * lanes;
    Element<K, Pack> e;
    for (int k = 0; k < K::arity; ++k)
      load_rows(f.rows, nodes + k * lanes, e.x[3 * k], e.x[3 * k + 1], e.x[3 * k + 2], e.w[k]);
    load_values(f.values + n * value_count<K>(damped) * lanes, damped, e);
    Pack lambda[K::rows], C_r[K::rows];
    double* multipliers = f.lambda + n * K::rows * lanes;
    for (int j = 0; j < K::rows; ++j) lambda[j] = load(multipliers + j * lanes);
    if (damped)
      for (int j = 0; j < K::rows; ++j) C_r[j] = load(f.C_r + (n * K::rows + j) * lanes);
    const Correction<K, Pack> correction(e, lambda, damped ? C_r : nullptr);
    if (f.record) {
      double* to = f.record + n * record_size<K> * lanes;
      for (int d = 0; d < K::dofs; ++d) store(to + d * lanes, e.x[d]);
      for (int j = 0; j < K::rows; ++j) {
        store(to + (K::dofs + j) * lanes, lambda[j]);
        store(to + (K::dofs + K::rows + j) * lanes, correction.dl[j]);
      }
    }
    for (int j = 0; j < K::rows; ++j) store(multipliers + j * lanes, lambda[j] + correction.dl[j]);
    for (int k = 0; k < K::arity; ++k) {
      Pack moved[3];
      for (int d = 0; d < 3; ++d) moved[d] = e.x[3 * k + d] + e.w[k] * correction.push[3 * k + d];
      store_rows(f.rows, nodes + k * lanes, moved[0], moved[1], moved[2], e.w[k]);
    }
  }
}

}  // namespace sheetbend
