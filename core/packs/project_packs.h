// The projection of as many constraints at a time as a register has lanes: of one color, or of as many scenes. The lanes of a color's short last
// pack repeat its last constraint: they compute and store the same numbers.
#pragma once

#include <type_traits>

#include "core/element/element.h"
#include "core/packs/kernels.h"
#include "core/packs/lanes.h"
#include "core/scalar/unrolled.h"

namespace sheetbend {

using sheetbend_packs::Layout;

template <class K>
inline constexpr int record_size = sheetbend_packs::record_size(Kept<K, Register>::size, K::rows);

template <class K>
constexpr int value_count(bool damped) {
  return sheetbend_packs::value_count(damped, parameter_count<K>, K::unit_gradients, K::arity);
}

// The numbers of place n in the order that kernels.h gives: the constraint's own parameters, and the rest.
template <class K>
struct LoadedParameters {
  Register p[parameter_count<K> > 0 ? parameter_count<K> : 1];
  LoadedParameters(const double* values, bool damped, long n) {
    const Strip from(values, n, value_count<K>(damped));
    for (int k = 0; k < parameter_count<K>; ++k) p[k] = from[(damped ? 3 : 1) + k];
  }
};

// `from` gives them one by one.
template <class K, class From, class T>
void load_values(From&& from, bool damped, Element<K, T>& e) {
  int next = 0;
  e.rates.a = from(next++);
  if (damped) {
    e.rates.g = from(next++);
    e.rates.scale = from(next++);
  }
  for (int k = 0; k < parameter_count<K>; ++k) e.p[k] = from(next++);
  if constexpr (K::unit_gradients) e.inverse = from(next++);
  for (int k = 0; k < K::arity; ++k) e.w[k] = from(next++);
}
template <class K>
void load_values(const double* values, bool damped, long n, Element<K, Register>& e) {
  const Strip from(values, n, value_count<K>(damped));
  load_values<K>([&from](int part) { return from[part]; }, damped, e);
}

// What the first of two stages may hand on in registers; more would be copied through memory.
inline constexpr std::size_t most_handed_on = 22 * sizeof(Register);

// Runs second(n, first(n)) for every n. With registers to spare, across a color the first of the next place comes before the second of this one: what
// takes long in the first (square roots, divisions) then overlaps the loads and stores around it. Places of one color share no particle.
template <Layout layout, class First, class Second>
inline __attribute__((always_inline)) void overlapped(long begin, long end, First&& first, Second&& second) {
  if (begin >= end) return;
  if constexpr (layout == sheetbend_packs::across_color && register_lanes == 8 &&
                sizeof(first(begin)) <= most_handed_on) {
    auto now = first(begin);
    for (long n = begin; n + 1 < end; ++n) {
      auto next = first(n + 1);  // not const: gcc keeps const aggregates in memory
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
  Register x[K::dofs], w[K::arity];
  GatheredStencil(const double* rows, const int* nodes, long n, bool with_w) {
    const Particles<layout> particles(nodes, n, K::arity);
    unrolled<K::arity>([&](int k) { particles.load(rows, k, x + 3 * k, with_w ? w + k : nullptr); });
  }
};

template <class K, Layout layout, class Damped>
inline __attribute__((always_inline)) void project_range(const sheetbend_packs::Forward& f, Damped damped, long begin,
                                                         long end) {
  struct Evaluated : GatheredStencil<K, layout> {
    Linearization<K, Register> value;
    Evaluated(const double* rows, const int* nodes, long n, const Register* p)
        : GatheredStencil<K, layout>(rows, nodes, n, false), value(this->x, p) {}
  };
  const auto evaluate = [&](long n) __attribute__((always_inline)) {
    return Evaluated(f.rows, f.nodes, n, LoadedParameters<K>(f.values, damped, n).p);
  };
  const auto correct = [&](long n, const Evaluated& at) __attribute__((always_inline)) {
    Element<K, Register> e;
    load_values(f.values, damped, n, e);
    const Strip multipliers(f.lambda, n, K::rows);
    Register lambda[K::rows], C_r[K::rows];
    for (int j = 0; j < K::rows; ++j) lambda[j] = f.fresh ? Register(0.0) : multipliers[j];
    if (damped)
      for (int j = 0; j < K::rows; ++j) C_r[j] = Strip(f.C_r, n, K::rows)[j];
    Correction<K, Register> correction(e, at.value, lambda, damped ? C_r : nullptr);
    if (f.record) {
      const Strip to(f.record, n, record_size<K>);
      constexpr int kept = Kept<K, Register>::size;
      Register numbers[kept];
      at.value.keep(at.x, numbers);
      unrolled<kept>([&](int i) { to.set(i, numbers[i]); });
      for (int j = 0; j < K::rows; ++j) {
        to.set(kept + j, lambda[j]);
        to.set(kept + K::rows + j, correction.dl[j]);
      }
    }
    for (int j = 0; j < K::rows; ++j) multipliers.set(j, lambda[j] + correction.dl[j]);
    const Particles<layout> particles(f.nodes, n, K::arity);
    Register moved[K::dofs];
    unrolled<K::dofs>([&](int d) { moved[d] = at.x[d] + e.w[d / 3] * correction.push[d]; });
    unrolled<K::arity>([&](int k) { particles.store(f.rows, k, moved + 3 * k, nullptr); });
  };
  overlapped<layout>(begin, end, evaluate, correct);
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
void project_packs(const sheetbend_packs::Forward& f, int begin, int end) {
  with_damped<K>(f.C_r != nullptr, [&](auto damped) {
    project_range<K, layout>(f, damped, places(layout, begin, f.count), places(layout, end, f.count));
  });
}

}  // namespace sheetbend
