// What a kernel loads and stores: a register's lanes of a pack, and the rows of the particles there. Of packs across one color, the rows
// [x, y, z, w] of as many particles as there are lanes become three or four registers, and back.
#pragma once

#include "core/packs/kernels.h"
#include "core/scalar/pack.h"

namespace sheetbend {

using Register = Lanes<register_lanes>;
inline constexpr int parts_per_pack = sheetbend_packs::lanes / register_lanes;

// Where entry `part` of `parts` of one lane stands in (packs, parts, 8).
inline long lane_at(int lane, int parts, int part) {
  return (static_cast<long>(lane / sheetbend_packs::lanes) * parts + part) * sheetbend_packs::lanes +
         lane % sheetbend_packs::lanes;
}

// A kernel's place: part n % parts_per_pack of pack n / parts_per_pack.
inline long pack_of(long n) { return n / parts_per_pack; }
inline long lane_of(long n) { return n % parts_per_pack * register_lanes; }

// The places of packs [0, packs): a color's last ones only where constraints are, so that none is projected twice.
inline long places(sheetbend_packs::Layout layout, int packs, int count) {
  const long all = static_cast<long>(packs) * parts_per_pack;
  if (layout == sheetbend_packs::across_scenes) return all;
  return std::min(all, (static_cast<long>(count) + register_lanes - 1) / register_lanes);
}

// The numbers of one place in an array (packs, count, 8).
template <class T>
class Strip {
 public:
  Strip(T* base, long n, int count) : data_(base + pack_of(n) * count * sheetbend_packs::lanes + lane_of(n)) {}
  Register operator[](int i) const { return *reinterpret_cast<const Register*>(data_ + i * sheetbend_packs::lanes); }
  void set(int i, const Register& value) const {
    *reinterpret_cast<Register*>(data_ + i * sheetbend_packs::lanes) = value;
  }
  void add(int i, const Register& value) const { set(i, (*this)[i] + value); }

 private:
  T* data_;
};

typedef double Row __attribute__((vector_size(32), may_alias));

inline const Row& row_at(const double* rows, int place) { return *reinterpret_cast<const Row*>(rows + place); }
inline Row& row_at(double* rows, int place) { return *reinterpret_cast<Row*>(rows + place); }

#if defined(__AVX512F__)

inline Register::Vector two_rows(const double* rows, int low, int high) {
  return __builtin_shufflevector(row_at(rows, low), row_at(rows, high), 0, 1, 2, 3, 4, 5, 6, 7);
}

inline void load_rows(const double* rows, const int* nodes, Register& x, Register& y, Register& z, Register& w) {
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

inline void store_rows(double* rows, const int* nodes, const Register& x, const Register& y, const Register& z,
                       const Register& w) {
  const auto xy02 = __builtin_shufflevector(x.v[0], y.v[0], 0, 8, 2, 10, 4, 12, 6, 14);
  const auto xy13 = __builtin_shufflevector(x.v[0], y.v[0], 1, 9, 3, 11, 5, 13, 7, 15);
  const auto zw02 = __builtin_shufflevector(z.v[0], w.v[0], 0, 8, 2, 10, 4, 12, 6, 14);
  const auto zw13 = __builtin_shufflevector(z.v[0], w.v[0], 1, 9, 3, 11, 5, 13, 7, 15);
  const auto r04 = __builtin_shufflevector(xy02, zw02, 0, 1, 8, 9, 4, 5, 12, 13);
  const auto r26 = __builtin_shufflevector(xy02, zw02, 2, 3, 10, 11, 6, 7, 14, 15);
  const auto r15 = __builtin_shufflevector(xy13, zw13, 0, 1, 8, 9, 4, 5, 12, 13);
  const auto r37 = __builtin_shufflevector(xy13, zw13, 2, 3, 10, 11, 6, 7, 14, 15);
  const auto put = [&](int i, const Register::Vector& two) {
    row_at(rows, nodes[i]) = __builtin_shufflevector(two, two, 0, 1, 2, 3);
    row_at(rows, nodes[i + 4]) = __builtin_shufflevector(two, two, 4, 5, 6, 7);
  };
  put(0, r04);
  put(1, r15);
  put(2, r26);
  put(3, r37);
}

#elif defined(__AVX__)

// The transpose of a 4 x 4 block, in place.
inline void transpose(Row& a, Row& b, Row& c, Row& d) {
  const Row ab0 = __builtin_shufflevector(a, b, 0, 4, 2, 6), ab1 = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const Row cd0 = __builtin_shufflevector(c, d, 0, 4, 2, 6), cd1 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  a = __builtin_shufflevector(ab0, cd0, 0, 1, 4, 5);
  b = __builtin_shufflevector(ab1, cd1, 0, 1, 4, 5);
  c = __builtin_shufflevector(ab0, cd0, 2, 3, 6, 7);
  d = __builtin_shufflevector(ab1, cd1, 2, 3, 6, 7);
}

inline void load_rows(const double* rows, const int* nodes, Register& x, Register& y, Register& z, Register& w) {
  Row a = row_at(rows, nodes[0]), b = row_at(rows, nodes[1]), c = row_at(rows, nodes[2]), d = row_at(rows, nodes[3]);
  transpose(a, b, c, d);
  x.v[0] = a, y.v[0] = b, z.v[0] = c, w.v[0] = d;
}

inline void store_rows(double* rows, const int* nodes, const Register& x, const Register& y, const Register& z,
                       const Register& w) {
  Row a = x.v[0], b = y.v[0], c = z.v[0], d = w.v[0];
  transpose(a, b, c, d);
  row_at(rows, nodes[0]) = a;
  row_at(rows, nodes[1]) = b;
  row_at(rows, nodes[2]) = c;
  row_at(rows, nodes[3]) = d;
}

#else

inline const Register::Vector& pair_at(const double* rows, int place) {
  return *reinterpret_cast<const Register::Vector*>(rows + place);
}
inline Register::Vector& pair_at(double* rows, int place) { return *reinterpret_cast<Register::Vector*>(rows + place); }

inline void load_rows(const double* rows, const int* nodes, Register& x, Register& y, Register& z, Register& w) {
  const auto xy0 = pair_at(rows, nodes[0]), xy1 = pair_at(rows, nodes[1]);
  const auto zw0 = pair_at(rows, nodes[0] + 2), zw1 = pair_at(rows, nodes[1] + 2);
  x.v[0] = __builtin_shufflevector(xy0, xy1, 0, 2);
  y.v[0] = __builtin_shufflevector(xy0, xy1, 1, 3);
  z.v[0] = __builtin_shufflevector(zw0, zw1, 0, 2);
  w.v[0] = __builtin_shufflevector(zw0, zw1, 1, 3);
}

inline void store_rows(double* rows, const int* nodes, const Register& x, const Register& y, const Register& z,
                       const Register& w) {
  pair_at(rows, nodes[0]) = __builtin_shufflevector(x.v[0], y.v[0], 0, 2);
  pair_at(rows, nodes[1]) = __builtin_shufflevector(x.v[0], y.v[0], 1, 3);
  pair_at(rows, nodes[0] + 2) = __builtin_shufflevector(z.v[0], w.v[0], 0, 2);
  pair_at(rows, nodes[1] + 2) = __builtin_shufflevector(z.v[0], w.v[0], 1, 3);
}

#endif

// A pack of several registers.
template <int N>
  requires(N > register_lanes)
void load_rows(const double* rows, const int* nodes, Lanes<N>& x, Lanes<N>& y, Lanes<N>& z, Lanes<N>& w) {
  for (int i = 0; i < Lanes<N>::pieces; ++i) {
    Register a, b, c, d;
    load_rows(rows, nodes + i * register_lanes, a, b, c, d);
    x.v[i] = a.v[0], y.v[i] = b.v[0], z.v[i] = c.v[0], w.v[i] = d.v[0];
  }
}
template <int N>
  requires(N > register_lanes)
void store_rows(double* rows, const int* nodes, const Lanes<N>& x, const Lanes<N>& y, const Lanes<N>& z,
                const Lanes<N>& w) {
  for (int i = 0; i < Lanes<N>::pieces; ++i) {
    Register a, b, c, d;
    a.v[0] = x.v[i], b.v[0] = y.v[i], c.v[0] = z.v[i], d.v[0] = w.v[i];
    store_rows(rows, nodes + i * register_lanes, a, b, c, d);
  }
}

// The particles of one place; w, where given, is the fourth number of their rows.
template <sheetbend_packs::Layout>
class Particles;

template <>
class Particles<sheetbend_packs::across_color> {
 public:
  Particles(const int* nodes, long n, int arity)
      : nodes_(nodes + pack_of(n) * arity * sheetbend_packs::lanes + lane_of(n)) {}
  void load(const double* rows, int k, Register* x, Register* w) const {
    Register ignored;
    load_rows(rows, nodes_ + k * sheetbend_packs::lanes, x[0], x[1], x[2], w ? *w : ignored);
  }
  void store(double* rows, int k, const Register* x, const Register* w) const {
    store_rows(rows, nodes_ + k * sheetbend_packs::lanes, x[0], x[1], x[2], w ? *w : x[2]);
  }

 private:
  const int* nodes_;
};

// Where the lanes are scenes, a row is four packs already; a pack's nodes stand in one lane of `nodes`.
template <>
class Particles<sheetbend_packs::across_scenes> {
 public:
  Particles(const int* nodes, long n, int arity)
      : nodes_(nodes + pack_of(n) / sheetbend_packs::lanes * arity * sheetbend_packs::lanes +
               pack_of(n) % sheetbend_packs::lanes),
        lane_(lane_of(n)) {}
  void load(const double* rows, int k, Register* x, Register* w) const {
    for (int d = 0; d < 3; ++d) x[d] = *reinterpret_cast<const Register*>(rows + place(k, d));
    if (w) *w = *reinterpret_cast<const Register*>(rows + place(k, 3));
  }
  void store(double* rows, int k, const Register* x, const Register* w) const {
    for (int d = 0; d < 3; ++d) *reinterpret_cast<Register*>(rows + place(k, d)) = x[d];
    if (w) *reinterpret_cast<Register*>(rows + place(k, 3)) = *w;
  }

 private:
  long place(int k, int d) const {
    return (static_cast<long>(nodes_[k * sheetbend_packs::lanes]) + d) * sheetbend_packs::lanes + lane_;
  }
  const int* nodes_;
  long lane_;
};

}  // namespace sheetbend
