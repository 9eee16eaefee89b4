// Vectors over any scalar with vectors of plain numbers, which have no derivatives to multiply.
#pragma once

#include "core/scalar/vec3.h"

namespace sheetbend {

template <class T>
concept Varying = !std::same_as<T, double>;

template <Varying T>
[[gnu::always_inline]] inline Vec3<T> operator-(const Vec3<T>& a, const Vec3<double>& b) {
  return {a.x - T(b.x), a.y - T(b.y), a.z - T(b.z)};
}
template <Varying T>
[[gnu::always_inline]] inline Vec3<T> operator-(const Vec3<double>& a, const Vec3<T>& b) {
  return {T(a.x) - b.x, T(a.y) - b.y, T(a.z) - b.z};
}
template <Varying T>
[[gnu::always_inline]] inline Vec3<T> operator*(const T& s, const Vec3<double>& a) {
  return {a.x * s, a.y * s, a.z * s};
}
template <Varying T>
T dot(const Vec3<double>& a, const Vec3<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

}  // namespace sheetbend
