// Three-vectors over any scalar, with plain (never conjugating) products.
#pragma once

#include "core/scalar/scalar.h"

namespace sheetbend {

template <class T>
struct Vec3 {
  T x{}, y{}, z{};
  Vec3() = default;
  Vec3(const T& a, const T& b, const T& c) : x(a), y(b), z(c) {}
  explicit Vec3(const T* p) : x(p[0]), y(p[1]), z(p[2]) {}
  void store(T* p) const { p[0] = x, p[1] = y, p[2] = z; }
  void add_to(T* p) const { p[0] += x, p[1] += y, p[2] += z; }
};

template <class T>
[[gnu::always_inline]] inline Vec3<T> operator+(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
[[gnu::always_inline]] inline Vec3<T> operator-(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T>
[[gnu::always_inline]] inline Vec3<T> operator-(const Vec3<T>& a) {
  return {-a.x, -a.y, -a.z};
}
template <class T>
[[gnu::always_inline]] inline Vec3<T> operator*(const T& s, const Vec3<T>& a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class T>
  requires(!std::same_as<T, double>)
[[gnu::always_inline]] inline Vec3<T> operator*(double s, const Vec3<T>& a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class T>
T dot(const Vec3<T>& a, const Vec3<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
T norm(const Vec3<T>& a) {
  return sqrt(dot(a, a));
}

}  // namespace sheetbend
