// Pack: eight doubles that go through a kernel together, one scene (or window, or start) per lane. Arithmetic, square roots and
// divisions are IEEE, so each lane has the bits that the scalar code would give. Transcendentals call the scalar function per lane.
#pragma once

#include "core/scalar/scalar.h"

namespace sheetbend {

// Its pieces are as wide as a register of the instruction set that is compiled for: compilers take wider vectors apart badly.
struct alignas(64) Pack {  // laid out the same on every instruction set
  static constexpr int lanes = 8;
#if defined(__AVX512F__)
  static constexpr int width = 8;
#elif defined(__AVX__)
  static constexpr int width = 4;
#else
  static constexpr int width = 2;
#endif
  static constexpr int pieces = lanes / width;
  typedef double Vector __attribute__((vector_size(8 * width), may_alias));
  typedef long long Bits __attribute__((vector_size(8 * width)));

  struct Mask {
    Bits bits[pieces];
  };

  Vector v[pieces];
  Pack() = default;  // without a value, as a double: arrays of packs need no loop that clears them
  Pack(double a) {
    for (Vector& piece : v) piece = a - Vector{};
  }
  double operator[](int lane) const { return v[lane / width][lane % width]; }
  void set(int lane, double a) { v[lane / width][lane % width] = a; }

  Pack& operator+=(const Pack& b) { return *this = *this + b; }
  Pack& operator-=(const Pack& b) { return *this = *this - b; }
  Pack& operator*=(const Pack& b) { return *this = *this * b; }

  // f on every piece of one or two packs.
  template <class F>
  static Pack map(const Pack& a, const Pack& b, F&& f) {
    Pack r;
    for (int i = 0; i < pieces; ++i) r.v[i] = f(a.v[i], b.v[i]);
    return r;
  }
  friend Pack operator-(const Pack& a) {
    return map(a, a, [](const Vector& x, const Vector&) { return -x; });
  }
  friend Pack operator+(const Pack& a, const Pack& b) {
    return map(a, b, [](const Vector& x, const Vector& y) { return x + y; });
  }
  friend Pack operator-(const Pack& a, const Pack& b) {
    return map(a, b, [](const Vector& x, const Vector& y) { return x - y; });
  }
  friend Pack operator*(const Pack& a, const Pack& b) {
    return map(a, b, [](const Vector& x, const Vector& y) { return x * y; });
  }
  friend Pack operator/(const Pack& a, const Pack& b) {
    return map(a, b, [](const Vector& x, const Vector& y) { return x / y; });
  }
  friend Mask operator>(const Pack& a, const Pack& b) {
    Mask m;
    for (int i = 0; i < pieces; ++i) m.bits[i] = a.v[i] > b.v[i];
    return m;
  }
  friend Mask operator<(const Pack& a, const Pack& b) { return b > a; }
  friend Pack select(const Mask& m, const Pack& a, const Pack& b) {
    Pack r;
    for (int i = 0; i < pieces; ++i) r.v[i] = m.bits[i] ? a.v[i] : b.v[i];
    return r;
  }
};

template <class F>
Pack per_lane(F&& f) {
  Pack r;
  for (int i = 0; i < Pack::lanes; ++i) r.set(i, f(i));
  return r;
}
inline Pack sqrt(const Pack& a) {
  return Pack::map(a, a, [](const Pack::Vector& x, const Pack::Vector&) {
#if defined(__AVX512F__)
    return Pack::Vector(__builtin_ia32_sqrtpd512_mask(x, x, 255, 4));  // 4: the current rounding mode
#elif defined(__AVX__)
    return Pack::Vector(__builtin_ia32_sqrtpd256(x));
#elif defined(__SSE2__)
    return Pack::Vector(__builtin_ia32_sqrtpd(x));
#else
    Pack::Vector r;
    for (int i = 0; i < Pack::width; ++i) r[i] = __builtin_sqrt(x[i]);
    return r;
#endif
  });
}
inline Pack sin(const Pack& a) {
  return per_lane([&](int i) { return std::sin(a[i]); });
}
inline Pack cos(const Pack& a) {
  return per_lane([&](int i) { return std::cos(a[i]); });
}
inline Pack log(const Pack& a) {
  return per_lane([&](int i) { return std::log(a[i]); });
}
inline Pack atan2(const Pack& y, const Pack& x) {
  return per_lane([&](int i) { return std::atan2(y[i], x[i]); });
}
inline Pack nearest(const Pack& a) {
  return per_lane([&](int i) { return std::nearbyint(a[i]); });
}
inline bool all_finite(const Pack& a) {
  bool ok = true;
  for (int i = 0; i < Pack::lanes; ++i) ok = ok && std::isfinite(a[i]);
  return ok;
}

}  // namespace sheetbend
