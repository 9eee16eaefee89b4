// Dual<T, N>: a value and N directional derivatives, both over any scalar T, nested freely. Dual<double, 8> carries eight columns of a
// Jacobian through one rollout; the adjoint's second derivatives are gradients on duals.
#pragma once

#include "core/scalar/scalar.h"

namespace sheetbend {

template <class T, int N = 1>
struct Dual {
  static constexpr int directions = N;
  // Where the directions of two of them fill more than 7/8 of all registers, they are in memory whatever is done. Unrolled, an operation on them is a hundred instructions,
  // which the processor fetches once each: a loop is faster, and a quarter of the code. Over plain numbers it is slower
  // (docs/decisions/what-a-build-compiles.md).
  static constexpr bool rolled = !std::same_as<T, double> &&
                                 16 * N * sizeof(T) > 7 * sizeof(double) * registers* register_lanes;
  // Directions first, so that code on pairs of them and copies of the whole move the same 16 bytes: a load across two stores that are still
  // under way waits for both, which took more than half the time of a rope's Jacobian.
  T d[N];
  T v;

  constexpr Dual() noexcept : d{}, v{} {}
  Dual(double a) : d{}, v(a) {}
  Dual(const T& a)
    requires(!std::same_as<T, double>)
      : d{}, v(a) {}

  Dual& operator+=(const Dual& b) {
    v = v + b.v;
    if constexpr (rolled)
      each([&](int i) { d[i] = d[i] + b.d[i]; });
    else
      for (int i = 0; i < N; ++i) d[i] = d[i] + b.d[i];
    return *this;
  }
  Dual& operator-=(const Dual& b) {
    v = v - b.v;
    if constexpr (rolled)
      each([&](int i) { d[i] = d[i] - b.d[i]; });
    else
      for (int i = 0; i < N; ++i) d[i] = d[i] - b.d[i];
    return *this;
  }
  Dual& operator*=(const Dual& b) { return *this = *this * b; }

  friend Dual operator-(const Dual& a) { return map(a, -a.v, T(-1.0)); }
  friend Dual operator+(Dual a, const Dual& b)
    requires(!rolled)
  {
    return a += b;
  }
  friend Dual operator+(const Dual& a, const Dual& b)
    requires rolled
  {
    return Dual(a.v + b.v, [&](int i) { return a.d[i] + b.d[i]; });
  }
  friend Dual operator-(Dual a, const Dual& b)
    requires(!rolled)
  {
    return a -= b;
  }
  friend Dual operator-(const Dual& a, const Dual& b)
    requires rolled
  {
    return Dual(a.v - b.v, [&](int i) { return a.d[i] - b.d[i]; });
  }
  friend Dual operator*(const Dual& a, const Dual& b) { return map(a, b, a.v * b.v, b.v, a.v); }
  friend Dual operator*(double a, const Dual& b) { return map(b, a * b.v, a); }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const T inverse = T(1.0) / b.v, q = a.v / b.v;
    return map(a, b, q, inverse, -q * inverse);
  }
  // Plain numbers have no derivatives to multiply: zero times a number is not known to be zero.
  friend Dual operator+(double a, Dual b) { return b.v = a + b.v, b; }
  friend Dual operator/(double a, const Dual& b) {
    const T inverse = 1.0 / b.v, q = a / b.v;
    return map(b, q, -q * inverse);
  }
  friend auto operator>(const Dual& a, const Dual& b) { return a.v > b.v; }
  friend auto operator<(const Dual& a, const Dual& b) { return a.v < b.v; }

  // Chain rule: f(a) with value f and derivative fa; f(a, b) with derivatives fa, fb.
  static Dual map(const Dual& a, const T& f, const T& fa) {
    if constexpr (rolled) return Dual(f, [&](int i) { return fa * a.d[i]; });
    Dual r;
    r.v = f;
    for (int i = 0; i < N; ++i) r.d[i] = fa * a.d[i];
    return r;
  }
  static Dual map(const Dual& a, const Dual& b, const T& f, const T& fa, const T& fb) {
    if constexpr (rolled) return Dual(f, [&](int i) { return fa * a.d[i] + fb * b.d[i]; });
    Dual r;
    r.v = f;
    for (int i = 0; i < N; ++i) r.d[i] = fa * a.d[i] + fb * b.d[i];
    return r;
  }

 private:
  // With value a and directions f(i); clears nothing first.
  template <class F>
  Dual(const T& a, const F& f) : v(a) {
    each([&](int i) { d[i] = f(i); });
  }

  // f(i) for every direction i, in a loop.
  template <class F>
  static void each(const F& f) {
#pragma GCC unroll 1
    for (int i = 0; i < N; ++i) f(i);
  }
};

// The T under a Dual<T, N>, or T itself.
template <class T>
const T& primal(const T& a) {
  return a;
}
template <class T, int N>
const T& primal(const Dual<T, N>& a) {
  return a.v;
}

template <class T, int N>
Dual<T, N> sqrt(const Dual<T, N>& a) {
  const T r = sqrt(a.v);
  return Dual<T, N>::map(a, r, T(0.5) * (T(1.0) / r));  // mostly 1/r is wanted as well
}
template <class T, int N>
Dual<T, N> sin(const Dual<T, N>& a) {
  return Dual<T, N>::map(a, sin(a.v), cos(a.v));
}
template <class T, int N>
Dual<T, N> cos(const Dual<T, N>& a) {
  return Dual<T, N>::map(a, cos(a.v), -sin(a.v));
}
template <class T, int N>
Dual<T, N> log(const Dual<T, N>& a) {
  return Dual<T, N>::map(a, log(a.v), T(1.0) / a.v);
}
template <class T, int N>
Dual<T, N> atan2(const Dual<T, N>& y, const Dual<T, N>& x) {
  const T inverse = T(1.0) / (x.v * x.v + y.v * y.v);
  return Dual<T, N>::map(y, x, atan2(y.v, x.v), x.v * inverse, -y.v * inverse);
}
template <class T, int N>
Dual<T, N> nearest(const Dual<T, N>& a) {
  return Dual<T, N>(nearest(a.v));
}
template <class M, class T, int N>
Dual<T, N> select(const M& mask, const Dual<T, N>& a, const Dual<T, N>& b) {
  Dual<T, N> r;
  r.v = select(mask, a.v, b.v);
  for (int i = 0; i < N; ++i) r.d[i] = select(mask, a.d[i], b.d[i]);
  return r;
}
template <class T, int N>
bool all_finite(const Dual<T, N>& a) {
  bool ok = all_finite(a.v);
  for (int i = 0; i < N; ++i) ok = ok && all_finite(a.d[i]);
  return ok;
}
template <class T, int N>
auto value_of(const Dual<T, N>& a) {
  return value_of(a.v);
}

}  // namespace sheetbend
