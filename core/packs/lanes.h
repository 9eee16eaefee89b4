// Rows of particles to lanes and back: eight times [x, y, z, w] become four packs. Nodes are given as places of their first number.
// Where the lanes are scenes, a row is four packs already.
#pragma once

#include "core/packs/kernels.h"
#include "core/scalar/pack.h"

namespace sheetbend {

inline Pack load(const double* from) { return *reinterpret_cast<const Pack*>(from); }
inline void store(double* to, const Pack& p) { *reinterpret_cast<Pack*>(to) = p; }

typedef double Row __attribute__((vector_size(32), may_alias));

inline const Row& row_at(const double* rows, int place) { return *reinterpret_cast<const Row*>(rows + place); }
inline Row& row_at(double* rows, int place) { return *reinterpret_cast<Row*>(rows + place); }

template <sheetbend_packs::Layout>
struct Particles;

template <>
struct Particles<sheetbend_packs::across_scenes> {
  const int* nodes;
  Particles(const int* all, long n, int arity)
      : nodes(all + n / sheetbend_packs::lanes * arity * sheetbend_packs::lanes + n % sheetbend_packs::lanes) {}
  long place(int k) const { return static_cast<long>(nodes[k * sheetbend_packs::lanes]) * sheetbend_packs::lanes; }
  void load_row(const double* rows, int k, Pack* x, Pack* w) const {
    const Pack* from = reinterpret_cast<const Pack*>(rows + place(k));
    for (int d = 0; d < 3; ++d) x[d] = from[d];
    if (w) *w = from[3];
  }
  void store_row(double* rows, int k, const Pack* x, const Pack* w) const {
    Pack* to = reinterpret_cast<Pack*>(rows + place(k));
    for (int d = 0; d < 3; ++d) to[d] = x[d];
    if (w) to[3] = *w;
  }
};

#if defined(__AVX512F__)

inline Pack::Vector two_rows(const double* rows, int low, int high) {
  return __builtin_shufflevector(row_at(rows, low), row_at(rows, high), 0, 1, 2, 3, 4, 5, 6, 7);
}

inline void load_rows(const double* rows, const int* nodes, Pack& x, Pack& y, Pack& z, Pack& w) {
  // [a b] holds rows a and b; xy01: x0 x4 x1 x5, y0 y4 y1 y5 and so on
  const auto r04 = two_rows(rows, nodes[0], nodes[4]), r15 = two_rows(rows, nodes[1], nodes[5]);
  const auto r26 = two_rows(rows, nodes[2], nodes[6]), r37 = two_rows(rows, nodes[3], nodes[7]);
  const auto xz01 = __builtin_shufflevector(r04, r15, 0, 8, 2, 10, 4, 12, 6, 14);
  const auto yw01 = __builtin_shufflevector(r04, r15, 1, 9, 3, 11, 5, 13, 7, 15);
  const auto xz23 = __builtin_shufflevector(r26, r37, 0, 8, 2, 10, 4, 12, 6, 14);
  const auto yw23 = __builtin_shufflevector(r26, r37, 1, 9, 3, 11, 5, 13, 7, 15);
  x.v[0] = __builtin_shufflevector(xz01, xz23, 0, 1, 8, 9, 4, 5, 12, 13);
  y.v[0] = __builtin_shufflevector(yw01, yw23, 0, 1, 8, 9, 4, 5, 12, 13);
  z.v[0] = __builtin_shufflevector(xz01, xz23, 2, 3, 10, 11, 6, 7, 14, 15);
  w.v[0] = __builtin_shufflevector(yw01, yw23, 2, 3, 10, 11, 6, 7, 14, 15);
}

inline void store_rows(double* rows, const int* nodes, const Pack& x, const Pack& y, const Pack& z, const Pack& w) {
  const auto xy02 = __builtin_shufflevector(x.v[0], y.v[0], 0, 8, 2, 10, 4, 12, 6, 14);
  const auto xy13 = __builtin_shufflevector(x.v[0], y.v[0], 1, 9, 3, 11, 5, 13, 7, 15);
  const auto zw02 = __builtin_shufflevector(z.v[0], w.v[0], 0, 8, 2, 10, 4, 12, 6, 14);
  const auto zw13 = __builtin_shufflevector(z.v[0], w.v[0], 1, 9, 3, 11, 5, 13, 7, 15);
  const auto r04 = __builtin_shufflevector(xy02, zw02, 0, 1, 8, 9, 4, 5, 12, 13);
  const auto r26 = __builtin_shufflevector(xy02, zw02, 2, 3, 10, 11, 6, 7, 14, 15);
  const auto r15 = __builtin_shufflevector(xy13, zw13, 0, 1, 8, 9, 4, 5, 12, 13);
  const auto r37 = __builtin_shufflevector(xy13, zw13, 2, 3, 10, 11, 6, 7, 14, 15);
  const auto put = [&](int i, const Pack::Vector& two) {
    row_at(rows, nodes[i]) = __builtin_shufflevector(two, two, 0, 1, 2, 3);
    row_at(rows, nodes[i + 4]) = __builtin_shufflevector(two, two, 4, 5, 6, 7);
  };
  put(0, r04);
  put(1, r15);
  put(2, r26);
  put(3, r37);
}

#else

// The transpose of a 4 x 4 block, in place.
inline void transpose(Row& a, Row& b, Row& c, Row& d) {
  const Row ab0 = __builtin_shufflevector(a, b, 0, 4, 2, 6), ab1 = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const Row cd0 = __builtin_shufflevector(c, d, 0, 4, 2, 6), cd1 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  a = __builtin_shufflevector(ab0, cd0, 0, 1, 4, 5);
  b = __builtin_shufflevector(ab1, cd1, 0, 1, 4, 5);
  c = __builtin_shufflevector(ab0, cd0, 2, 3, 6, 7);
  d = __builtin_shufflevector(ab1, cd1, 2, 3, 6, 7);
}

inline Row& half(Pack& p, int i) { return reinterpret_cast<Row*>(&p)[i]; }
inline const Row& half(const Pack& p, int i) { return reinterpret_cast<const Row*>(&p)[i]; }

inline void load_rows(const double* rows, const int* nodes, Pack& x, Pack& y, Pack& z, Pack& w) {
  for (int h = 0; h < 2; ++h) {
    const int* n = nodes + 4 * h;
    Row a = row_at(rows, n[0]), b = row_at(rows, n[1]), c = row_at(rows, n[2]), d = row_at(rows, n[3]);
    transpose(a, b, c, d);
    half(x, h) = a;
    half(y, h) = b;
    half(z, h) = c;
    half(w, h) = d;
  }
}

inline void store_rows(double* rows, const int* nodes, const Pack& x, const Pack& y, const Pack& z, const Pack& w) {
  for (int h = 0; h < 2; ++h) {
    const int* n = nodes + 4 * h;
    Row a = half(x, h), b = half(y, h), c = half(z, h), d = half(w, h);
    transpose(a, b, c, d);
    row_at(rows, n[0]) = a;
    row_at(rows, n[1]) = b;
    row_at(rows, n[2]) = c;
    row_at(rows, n[3]) = d;
  }
}

#endif

template <>
struct Particles<sheetbend_packs::across_color> {
  const int* nodes;
  Particles(const int* all, long n, int arity) : nodes(all + n * arity * sheetbend_packs::lanes) {}
  void load_row(const double* rows, int k, Pack* x, Pack* w) const {
    Pack ignored;
    load_rows(rows, nodes + k * sheetbend_packs::lanes, x[0], x[1], x[2], w ? *w : ignored);
  }
  void store_row(double* rows, int k, const Pack* x, const Pack* w) const {
    store_rows(rows, nodes + k * sheetbend_packs::lanes, x[0], x[1], x[2], w ? *w : x[2]);
  }
};

}  // namespace sheetbend
