// Lanes<N>: N doubles that go through a kernel together. A Pack of eight holds one scene (or window, or start) per lane, or eight constraints;
// the kernels work on as many lanes as one register has. Arithmetic, square roots and divisions are IEEE, so each lane has the bits that the
// scalar code would give; atan2 is made of them. Kernels need no other transcendental function, so lanes offer none.
#pragma once

#include <algorithm>

#include "core/scalar/scalar.h"

namespace sheetbend {

// Its pieces are registers: compilers take wider vectors apart badly. It is laid out the same on every instruction set.
template <int N>
struct alignas(8 * N) Lanes {
  static constexpr int lanes = N;
  static constexpr int width = std::min(N, register_lanes);
  static constexpr int pieces = lanes / width;
  typedef double Vector __attribute__((vector_size(8 * width), may_alias));
  typedef long long Bits __attribute__((vector_size(8 * width)));

  struct Mask {
    Bits bits[pieces];
  };

  Vector v[pieces];
  Lanes() = default;  // without a value, as a double: arrays of them need no loop that clears them
  Lanes(double a) {
    for (Vector& piece : v) piece = a - Vector{};
  }
  double operator[](int lane) const { return v[lane / width][lane % width]; }
  void set(int lane, double a) { v[lane / width][lane % width] = a; }

  Lanes& operator+=(const Lanes& b) { return *this = *this + b; }
  Lanes& operator-=(const Lanes& b) { return *this = *this - b; }
  Lanes& operator*=(const Lanes& b) { return *this = *this * b; }

  // f on every piece of one or two packs.
  template <class F>
  [[gnu::always_inline]] static inline Lanes map(const Lanes& a, const Lanes& b, F&& f) {
    Lanes r;
    for (int i = 0; i < pieces; ++i) r.v[i] = f(a.v[i], b.v[i]);
    return r;
  }
  [[gnu::always_inline]] friend inline Lanes operator-(const Lanes& a) {
    return map(a, a, [](const Vector& x, const Vector&) { return -x; });
  }
  [[gnu::always_inline]] friend inline Lanes operator+(const Lanes& a, const Lanes& b) {
    return map(a, b, [](const Vector& x, const Vector& y) { return x + y; });
  }
  [[gnu::always_inline]] friend inline Lanes operator-(const Lanes& a, const Lanes& b) {
    return map(a, b, [](const Vector& x, const Vector& y) { return x - y; });
  }
  [[gnu::always_inline]] friend inline Lanes operator*(const Lanes& a, const Lanes& b) {
    return map(a, b, [](const Vector& x, const Vector& y) { return x * y; });
  }
  [[gnu::always_inline]] friend inline Lanes operator/(const Lanes& a, const Lanes& b) {
    return map(a, b, [](const Vector& x, const Vector& y) { return x / y; });
  }
  friend Mask operator>(const Lanes& a, const Lanes& b) {
    Mask m;
    for (int i = 0; i < pieces; ++i) m.bits[i] = a.v[i] > b.v[i];
    return m;
  }
  friend Mask operator<(const Lanes& a, const Lanes& b) { return b > a; }
  friend Lanes select(const Mask& m, const Lanes& a, const Lanes& b) {
    Lanes r;
    for (int i = 0; i < pieces; ++i) r.v[i] = m.bits[i] ? a.v[i] : b.v[i];
    return r;
  }
  friend Lanes magnitude(const Lanes& a) { return with_sign(a, Lanes(0.0)); }
  friend Lanes with_sign(const Lanes& size, const Lanes& sign) {
    return map(size, sign, [](const Vector& x, const Vector& y) {
      const Vector minus_zero = -Vector{};
      return Vector((Bits(x) & ~Bits(minus_zero)) | (Bits(y) & Bits(minus_zero)));
    });
  }
};

using Pack = Lanes<8>;

template <int N = Pack::lanes, class F>
Lanes<N> per_lane(F&& f) {
  Lanes<N> r;
  for (int i = 0; i < N; ++i) r.set(i, f(i));
  return r;
}
template <int N>
Lanes<N> sqrt(const Lanes<N>& a) {
  using Vector = typename Lanes<N>::Vector;
  return Lanes<N>::map(a, a, [](const Vector& x, const Vector&) {
#if __has_builtin(__builtin_elementwise_sqrt)  // clang, whose newer versions lack those of gcc
    return Vector(__builtin_elementwise_sqrt(x));
#else
#if defined(__AVX512F__)
    if constexpr (sizeof(Vector) == 64)
      return Vector(__builtin_ia32_sqrtpd512_mask(x, x, 255, 4));  // 4: as rounded now
#endif
#if defined(__AVX__)
    if constexpr (sizeof(Vector) == 32) return Vector(__builtin_ia32_sqrtpd256(x));
#endif
#if defined(__SSE2__)
    if constexpr (sizeof(Vector) == 16) return Vector(__builtin_ia32_sqrtpd(x));
#endif
    Vector r;
    for (int i = 0; i < Lanes<N>::width; ++i) r[i] = __builtin_sqrt(x[i]);
    return r;
#endif
  });
}
template <int N>
Lanes<N> atan2(const Lanes<N>& y, const Lanes<N>& x) {
  return angle_of(y, x);
}
template <int N>
Lanes<N> nearest(const Lanes<N>& a) {
  return per_lane<N>([&](int i) { return std::nearbyint(a[i]); });
}
template <int N>
bool all_finite(const Lanes<N>& a) {
  bool ok = true;
  for (int i = 0; i < N; ++i) ok = ok && std::isfinite(a[i]);
  return ok;
}

}  // namespace sheetbend
