// Pack: eight doubles that go through a kernel together, one scene (or window, or start) per lane. Arithmetic, square roots and
// divisions are IEEE, so each lane has the bits that the scalar code would give. Transcendentals call the scalar function per lane.
#pragma once

#include "core/scalar/scalar.h"

namespace sheetbend {

struct Pack {
  static constexpr int lanes = 8;
  typedef double Vector __attribute__((vector_size(64)));
  typedef long long Bits __attribute__((vector_size(64)));

  struct Mask {
    Bits bits;
  };

  Vector v{};
  Pack() = default;
  Pack(double a) : v(a - Vector{}) {}
  explicit Pack(const Vector& a) : v(a) {}
  double operator[](int lane) const { return v[lane]; }
  void set(int lane, double a) { v[lane] = a; }

  Pack& operator+=(const Pack& b) { return v += b.v, *this; }
  Pack& operator-=(const Pack& b) { return v -= b.v, *this; }
  Pack& operator*=(const Pack& b) { return v *= b.v, *this; }
};

inline Pack operator-(const Pack& a) { return Pack(-a.v); }
inline Pack operator+(const Pack& a, const Pack& b) { return Pack(a.v + b.v); }
inline Pack operator-(const Pack& a, const Pack& b) { return Pack(a.v - b.v); }
inline Pack operator*(const Pack& a, const Pack& b) { return Pack(a.v * b.v); }
inline Pack operator/(const Pack& a, const Pack& b) { return Pack(a.v / b.v); }
inline Pack::Mask operator>(const Pack& a, const Pack& b) { return {a.v > b.v}; }
inline Pack::Mask operator<(const Pack& a, const Pack& b) { return {a.v < b.v}; }
inline Pack select(const Pack::Mask& m, const Pack& a, const Pack& b) { return Pack(m.bits ? a.v : b.v); }

template <class F>
Pack per_lane(F&& f) {
  Pack r;
  for (int i = 0; i < Pack::lanes; ++i) r.v[i] = f(i);
  return r;
}
inline Pack sqrt(const Pack& a) {
  return per_lane([&](int i) { return __builtin_sqrt(a[i]); });
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
