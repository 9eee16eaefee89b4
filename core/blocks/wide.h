// What a member's kernel computes with, and where it stands: as many members at a time as a register has lanes where numbers are plain doubles, as many
// scenes of one member where they are packs of eight scenes, single members over any other scalar (tangents, complex steps).
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
inline constexpr bool scenes_in_lanes = std::is_same_v<T, Pack>;
template <class T>
using Wide = std::conditional_t<members_in_lanes<T> || scenes_in_lanes<T>, Register, T>;

template <class T>
T* numbers_of(double* p) {
  return reinterpret_cast<T*>(p);
}
template <class T>
const T* numbers_of(const double* p) {
  return reinterpret_cast<const T*>(p);
}

// What follows x, y and z in rows whose fourth number is not to change, or that nobody reads. gcc 12 may shuffle z with itself where it knows that the
// other is zero (in blocks of sheet_curvature, x86-64-v4), so it must not know.
inline Register fourth_zero() {
  Register zero(0.0);
#if defined(__AVX512F__) && !defined(__clang__)
  asm("" : "+v"(zero.v[0]));
#endif
  return zero;
}

// The n-th place of a run. Loads and stores bring numbers from where they stand in arrays of T to a Wide<T> and back.
template <class T>
class Place {
 public:
  using W = Wide<T>;

  static int count(const sheetbend_blocks::Run& r) {
    if (members_in_lanes<T>) return (r.count + register_lanes - 1) / register_lanes;
    return scenes_in_lanes<T> ? r.count * parts_per_pack : r.count;
  }

  explicit Place(int n) : n_(n) {}

  // Where the indices of its members begin in (packs, parts, 8).
  const int* indices(const int* from, int parts) const {
    if (members_in_lanes<T>) return from + pack_of(n_) * parts * Pack::lanes + lane_of(n_);
    const long member = scenes_in_lanes<T> ? pack_of(n_) : n_;
    return from + member / Pack::lanes * parts * Pack::lanes + member % Pack::lanes;
  }

  // How many members it has; the other lanes repeat the run's last one.
  int members(const sheetbend_blocks::Run& r) const {
    return members_in_lanes<T> ? std::min(r.count - n_ * register_lanes, register_lanes) : 1;
  }

  // Number i of `count` per pack or member.
  W& value(double* values, int count, int i) const {
    if constexpr (members_in_lanes<T> || scenes_in_lanes<T>)
      return reinterpret_cast<W&>(values[(pack_of(n_) * count + i) * Pack::lanes + lane_of(n_)]);
    else
      return numbers_of<T>(values)[static_cast<long>(n_) * count + i];
  }
  const W& value(const double* values, int count, int i) const { return value(const_cast<double*>(values), count, i); }

  // Number place[...] + i.
  W gather(const double* from, const int* place, int i) const {
    if constexpr (members_in_lanes<T>)
      return per_lane<register_lanes>([&](int lane) { return from[place[lane] + i]; });
    else
      return number(from, *place + i);
  }
  void scatter(double* to, const int* place, int i, const W& value) const {
    if constexpr (members_in_lanes<T>)
      for (int lane = 0; lane < register_lanes; ++lane) to[place[lane] + i] = value[lane];
    else
      number(to, *place + i) = value;
  }

  // The row of one particle: three coordinates, and its inverse mass.
  void load_row(const double* rows, const int* place, W* x, W& w) const {
    if constexpr (members_in_lanes<T>) {
      load_rows(rows, place, x[0], x[1], x[2], w);
    } else {
      for (int d = 0; d < 3; ++d) x[d] = number(rows, *place + d);
      w = number(rows, *place + 3);
    }
  }
  // From number `first` on, a row whose fourth number nobody reads.
  void store_row(double* rows, const int* place, int first, const W* x) const {
    if constexpr (members_in_lanes<T>)
      store_rows(rows + first, place, x[0], x[1], x[2], fourth_zero());
    else
      for (int d = 0; d < 3; ++d) number(rows, *place + first + d) = x[d];
  }
  template <int Arity>
  void load_stencil(const double* rows, const int* nodes, W* x) const {
    W unused;
    for (int k = 0; k < Arity; ++k) load_row(rows, nodes + k * Pack::lanes, x + 3 * k, unused);
  }

  // Adds x (arity, 3) to the rows of a stencil's particles. Members of one place may share a particle, so they add one after the other.
  template <int Arity>
  void add_to_stencil(double* rows, const int* nodes, [[maybe_unused]] const sheetbend_blocks::Run& r,
                      const W* x) const {
    if constexpr (members_in_lanes<T>) {
      constexpr int at[] = {0, 4, 8, 12, 16, 20, 24, 28};
      Register by[Arity][sheetbend_blocks::row];
      for (int k = 0; k < Arity; ++k)
        store_rows(reinterpret_cast<double*>(by[k]), at, x[3 * k], x[3 * k + 1], x[3 * k + 2], fourth_zero());
      for (int lane = 0; lane < members(r); ++lane)
        for (int k = 0; k < Arity; ++k)
          row_at(rows, nodes[k * Pack::lanes + lane]) += row_at(reinterpret_cast<double*>(by[k]), at[lane]);
    } else {
      for (int d = 0; d < 3 * Arity; ++d) number(rows, nodes[d / 3 * Pack::lanes] + d % 3) += x[d];
    }
  }

  // Its constraints, whose own parameters come last among the values of a pack or member.
  template <class K>
  void load_parameters(const sheetbend_blocks::Run& r, W* p) const {
    const int count = sheetbend_blocks::value_count(r.damped, parameter_count<K>);
    for (int k = 0; k < parameter_count<K>; ++k) p[k] = value(r.values, count, count - parameter_count<K> + k);
  }
  template <class K>
  Element<K, W> load_element(const double* x, const sheetbend_blocks::Run& r, const int* nodes) const {
    Element<K, W> e;
    for (int k = 0; k < K::arity; ++k) load_row(x, nodes + k * Pack::lanes, e.x + 3 * k, e.w[k]);
    const int count = sheetbend_blocks::value_count(r.damped, parameter_count<K>);
    e.rates.a = value(r.values, count, 0);
    if (r.damped) {
      e.rates.g = value(r.values, count, 1);
      e.rates.scale = value(r.values, count, 2);
    }
    load_parameters<K>(r, e.p);
    return e;
  }

 private:
  // Number i of an array of T, where members are single.
  W& number(double* numbers, long i) const {
    if constexpr (scenes_in_lanes<T>)
      return reinterpret_cast<W&>(numbers[i * Pack::lanes + lane_of(n_)]);
    else
      return numbers_of<T>(numbers)[i];
  }
  const W& number(const double* numbers, long i) const { return number(const_cast<double*>(numbers), i); }

  int n_;
};

}  // namespace sheetbend
