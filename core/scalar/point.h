// The three coordinates of a particle as one value, read from and written to rows of any stride. In double precision a point is two pairs whose
// last number means nothing: it reads and writes one number too many, which the next particle's overwrites.
#pragma once

#include <type_traits>

#include "core/scalar/vec3.h"

namespace sheetbend {

template <class T>
struct Exactly {
  using Point = Vec3<T>;
  static Point load(const T* from) { return Point(from); }
  static void store(T* to, const Point& p) { p.store(to); }
  static void add(T* to, const Point& p) { p.add_to(to); }
};

struct InFours {
  // Two halves, since the code around has no wider registers on every machine.
  struct Point {
    typedef double Half __attribute__((vector_size(16), may_alias));
    typedef double Unaligned __attribute__((vector_size(16), may_alias, aligned(8)));
    Half low, high;
    friend Point operator+(const Point& a, const Point& b) { return {a.low + b.low, a.high + b.high}; }
    friend Point operator-(const Point& a, const Point& b) { return {a.low - b.low, a.high - b.high}; }
    friend Point operator-(const Point& a) { return {-a.low, -a.high}; }
    friend Point scaled(double s, const Point& p) { return {s * p.low, s * p.high}; }
  };
  static Point load(const double* from) {
    return {*reinterpret_cast<const Point::Unaligned*>(from), *reinterpret_cast<const Point::Unaligned*>(from + 2)};
  }
  static void store(double* to, const Point& p) {
    *reinterpret_cast<Point::Unaligned*>(to) = p.low;
    *reinterpret_cast<Point::Unaligned*>(to + 2) = p.high;
  }
  // The number after the point stays as it is.
  static void add(double* to, const Point& p) {
    *reinterpret_cast<Point::Unaligned*>(to) += p.low;
    to[2] += p.high[0];
  }
};

// A sum over points that stays in registers.
template <class T>
struct PointSum {
  Vec3<T> sum;
  void add(const Vec3<T>& p) { sum = sum + p; }
  Vec3<T> total() const { return sum; }
};
template <>
struct PointSum<double> {
  InFours::Point sum{};
  void add(const InFours::Point& p) { sum = sum + p; }
  void add(const Vec3<double>& p) { add(InFours::Point{{p.x, p.y}, {p.z, 0.0}}); }
  Vec3<double> total() const { return {sum.low[0], sum.low[1], sum.high[0]}; }
};

// Calls f(n, how) for the points [begin, end), `how` being the way to load and store them; the last one is touched exactly.
template <class T, class F>
inline __attribute__((always_inline)) void for_each_point(int begin, int end, F f) {
  if constexpr (std::is_same_v<T, double>) {
    for (int n = begin; n < end - 1; ++n) f(n, InFours{});
    if (begin < end) f(end - 1, Exactly<T>{});
  } else {
    for (int n = begin; n < end; ++n) f(n, Exactly<T>{});
  }
}

// s p, for either kind of point.
template <class S, class T>
Vec3<T> scaled(const S& s, const Vec3<T>& p) {
  return s * p;
}

}  // namespace sheetbend
