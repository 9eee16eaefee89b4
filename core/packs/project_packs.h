// The projection of eight constraints at a time: of one color, or of eight scenes. The lanes of a color's short last pack repeat its last
// constraint: they compute and store the same numbers.
#pragma once

#include <type_traits>

#include "core/element/element.h"
#include "core/packs/kernels.h"
#include "core/packs/lanes.h"
#include "core/scalar/unrolled.h"

namespace sheetbend {

using sheetbend_packs::Layout;

template <class K>
inline constexpr int record_size = sheetbend_packs::record_size(Kept<K, Pack>::size, K::rows);

template <class K>
constexpr int value_count(bool damped) {
  return sheetbend_packs::value_count(damped, parameter_count<K>, K::unit_gradients, K::arity);
}

inline const Pack* packs_at(const double* from, long pack) { return reinterpret_cast<const Pack*>(from) + pack; }
inline Pack* packs_at(double* from, long pack) { return reinterpret_cast<Pack*>(from) + pack; }

// The numbers of pack n in the order that kernels.h gives: the constraint's own parameters, and the rest.
template <class K>
const Pack* parameters_of(const double* values, bool damped, long n) {
  return packs_at(values, n * value_count<K>(damped) + (damped ? 3 : 1));
}

template <class K>
void load_values(const double* values, bool damped, long n, Element<K, Pack>& e) {
  const Pack* from = packs_at(values, n * value_count<K>(damped));
  e.rates.a = *from++;
  if (damped) {
    e.rates.g = *from++;
    e.rates.scale = *from++;
  }
  for (int k = 0; k < parameter_count<K>; ++k) e.p[k] = *from++;
  if constexpr (K::unit_gradients) e.inverse = *from++;
  for (int k = 0; k < K::arity; ++k) e.w[k] = *from++;
}

// Runs second(n, first(n)) for every n, the first of the next pack before the second of this one where registers allow: what takes long in
// the first (square roots, divisions) then overlaps the loads and stores around it. Packs of one color share nothing.
template <class First, class Second>
inline __attribute__((always_inline)) void overlapped(long begin, long end, First&& first, Second&& second) {
  if (begin >= end) return;
  if constexpr (Pack::pieces == 1) {
    auto now = first(begin);
    for (long n = begin; n + 1 < end; ++n) {
      auto next = first(n + 1);
      second(n, now);
      now = next;
    }
    second(end - 1, now);
  } else {
    for (long n = begin; n < end; ++n) second(n, first(n));
  }
}

template <class K, Layout layout>
struct GatheredStencil {
  Pack x[K::dofs], w[K::arity];
  GatheredStencil(const double* rows, const int* nodes, long n, bool with_w) {
    const Particles<layout> particles(nodes, n, K::arity);
    unrolled<K::arity>([&](int k) { particles.load_row(rows, k, x + 3 * k, with_w ? w + k : nullptr); });
  }
};

template <class K, Layout layout, class Damped>
inline __attribute__((always_inline)) void project_range(const sheetbend_packs::Forward& f, Damped damped, int begin, int end) {
  struct Evaluated : GatheredStencil<K, layout> {
    Linearization<K, Pack> value;
    Evaluated(const double* rows, const int* nodes, long n, const Pack* p)
        : GatheredStencil<K, layout>(rows, nodes, n, false), value(this->x, p) {}
  };
  const auto evaluate = [&](long n) __attribute__((always_inline)) {
    return Evaluated(f.rows, f.nodes, n, parameters_of<K>(f.values, damped, n));
  };
  const auto correct = [&](long n, const Evaluated& at) __attribute__((always_inline)) {
    Element<K, Pack> e;
    load_values(f.values, damped, n, e);
    Pack* lambda = packs_at(f.lambda, n * K::rows);
    Correction<K, Pack> correction(e, at.value, lambda, damped ? packs_at(f.C_r, n * K::rows) : nullptr);
    if (f.record) {
      Pack* to = packs_at(f.record, n * record_size<K>);
      at.value.keep(at.x, to);
      for (int j = 0; j < K::rows; ++j) {
        to[Kept<K, Pack>::size + j] = lambda[j];
        to[Kept<K, Pack>::size + K::rows + j] = correction.dl[j];
      }
    }
    for (int j = 0; j < K::rows; ++j) lambda[j] += correction.dl[j];
    const Particles<layout> particles(f.nodes, n, K::arity);
    Pack moved[K::dofs];
    unrolled<K::dofs>([&](int d) { moved[d] = at.x[d] + e.w[d / 3] * correction.push[d]; });
    unrolled<K::arity>([&](int k) { particles.store_row(f.rows, k, moved + 3 * k, nullptr); });
  };
  overlapped(begin, end, evaluate, correct);
}

// Calls f with whether the constraints are damped: as a constant for the hot kinds, those with a geometry of their own (the others would only
// compile longer).
template <class K, class F>
inline __attribute__((always_inline)) void with_damped(bool damped, F&& f) {
  if constexpr (HasGeometry<K>)
    damped ? f(std::true_type{}) : f(std::false_type{});
  else
    f(damped);
}

template <class K, Layout layout>
[[SHEETBEND_FLATTEN]] void project_packs(const sheetbend_packs::Forward& f, int begin, int end) {
  with_damped<K>(f.C_r != nullptr, [&](auto damped) { project_range<K, layout>(f, damped, begin, end); });
}

}  // namespace sheetbend
