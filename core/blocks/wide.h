// What a member's kernel computes with: packs of eight members where numbers are plain doubles, single members over any other scalar (eight
// scenes in lanes, tangents, complex steps). Loads and stores bring numbers from where they stand to that form and back.
#pragma once

#include <algorithm>
#include <type_traits>

#include "core/blocks/kernels.h"
#include "core/element/element.h"
#include "core/packs/lanes.h"

namespace sheetbend {

template <class T>
inline constexpr bool members_in_lanes = std::is_same_v<T, double>;
template <class T>
using Wide = std::conditional_t<members_in_lanes<T>, Pack, T>;

template <class T>
T* numbers_of(double* p) {
  return reinterpret_cast<T*>(p);
}
template <class T>
const T* numbers_of(const double* p) {
  return reinterpret_cast<const T*>(p);
}

// How many packs or single members a run has, and where the n-th one's indices begin in (packs, parts, 8).
template <class T>
int elements(const sheetbend_blocks::Run& r) {
  return members_in_lanes<T> ? (r.count + Pack::lanes - 1) / Pack::lanes : r.count;
}
template <class T>
const int* indices_of(const int* from, int parts, int n) {
  const long lanes = Pack::lanes;
  return members_in_lanes<T> ? from + n * parts * lanes : from + n / lanes * parts * lanes + n % lanes;
}

template <class T>
void load_particle(const T* rows, const int* place, Wide<T>* x, Wide<T>& w) {
  if constexpr (members_in_lanes<T>) {
    load_rows(rows, place, x[0], x[1], x[2], w);
  } else {
    for (int d = 0; d < 3; ++d) x[d] = rows[*place + d];
    w = rows[*place + 3];
  }
}

// Adds x (arity, 3) to the rows of a stencil's particles. Members of one pack may share a particle, so they add one after the other.
template <int Arity, class T>
void add_to_particles(T* rows, const int* nodes, [[maybe_unused]] int members, const Wide<T>* x) {
  if constexpr (members_in_lanes<T>) {
    constexpr int at[] = {0, 4, 8, 12, 16, 20, 24, 28};
    Pack by[Arity][sheetbend_blocks::row];
    for (int k = 0; k < Arity; ++k)
      store_rows(reinterpret_cast<double*>(by[k]), at, x[3 * k], x[3 * k + 1], x[3 * k + 2], Pack(0.0));
    for (int lane = 0; lane < std::min(members, Pack::lanes); ++lane)
      for (int k = 0; k < Arity; ++k)
        row_at(rows, nodes[k * Pack::lanes + lane]) += row_at(reinterpret_cast<double*>(by[k]), at[lane]);
  } else {
    for (int d = 0; d < 3 * Arity; ++d) rows[nodes[d / 3 * Pack::lanes] + d % 3] += x[d];
  }
}

// Row `j` of a member's gradient with respect to one particle.
template <class T>
void store_gradient(T* rows, const int* place, int j, const Wide<T>* J) {
  T* to = rows + sheetbend_blocks::row * j;
  if constexpr (members_in_lanes<T>)
    store_rows(to, place, J[0], J[1], J[2], Pack(0.0));
  else
    for (int d = 0; d < 3; ++d) to[*place + d] = J[d];
}

template <class T>
Wide<T> gather(const T* from, const int* place, int j) {
  if constexpr (members_in_lanes<T>) {
    return per_lane([&](int lane) { return from[place[lane] + j]; });
  } else {
    return from[*place + j];
  }
}
template <class T>
void scatter(T* to, const int* place, int j, const Wide<T>& value) {
  if constexpr (members_in_lanes<T>)
    for (int lane = 0; lane < Pack::lanes; ++lane) to[place[lane] + j] = value[lane];
  else
    to[*place + j] = value;
}

// The constraints' own parameters come last among the values of a pack or member.
template <class K, class T>
const Wide<T>* values_of(const sheetbend_blocks::Run& r, int n) {
  return numbers_of<Wide<T>>(r.values) +
         static_cast<long>(n) * sheetbend_blocks::value_count(r.damped, parameter_count<K>);
}
template <class K, class T>
const Wide<T>* parameters_of(const sheetbend_blocks::Run& r, int n) {
  return values_of<K, T>(r, n) + sheetbend_blocks::value_count(r.damped, 0);
}

template <class K, class T>
Element<K, Wide<T>> load_element(const double* x, const sheetbend_blocks::Run& r, const int* nodes, int n) {
  Element<K, Wide<T>> e;
  for (int k = 0; k < K::arity; ++k) load_particle(numbers_of<T>(x), nodes + k * Pack::lanes, e.x + 3 * k, e.w[k]);
  const Wide<T>* values = values_of<K, T>(r, n);
  e.rates.a = values[0];
  if (r.damped) {
    e.rates.g = values[1];
    e.rates.scale = values[2];
  }
  for (int k = 0; k < parameter_count<K>; ++k) e.p[k] = parameters_of<K, T>(r, n)[k];
  return e;
}

}  // namespace sheetbend
