// What a scalar must offer. Every kernel is a template over T: double, Complex (tests), Dual<T, N> (tangents), Pack (lanes),
// and duals over packs. Branches on values go through select(), so that a pack takes both sides lane by lane.
#pragma once

#include <cmath>
#include <concepts>

#include "core/scalar/elementary.h"

namespace sheetbend {

// Doubles in a register of the instruction set that is compiled for, and how many registers it has.
#if defined(__AVX512F__)
inline constexpr int register_lanes = 8, registers = 32;
#elif defined(__AVX__)
inline constexpr int register_lanes = 4, registers = 16;
#elif defined(__x86_64__)
inline constexpr int register_lanes = 2, registers = 16;
#else
inline constexpr int register_lanes = 2, registers = 32;
#endif

inline double sqrt(double a) { return __builtin_sqrt(a); }
inline double atan2(double y, double x) { return angle_of(y, x); }
inline double sin(double a) { return std::sin(a); }
inline double cos(double a) { return std::cos(a); }
inline double log(double a) { return std::log(a); }
inline double nearest(double a) { return std::nearbyint(a); }
inline bool all_finite(double a) { return std::isfinite(a); }
// The plain number that branches may look at.
inline double value_of(double a) { return a; }

template <class T>
concept Scalar = requires(T a, T b, double c) {
  { a + b } -> std::convertible_to<T>;
  { a - b } -> std::convertible_to<T>;
  { a * b } -> std::convertible_to<T>;
  { a / b } -> std::convertible_to<T>;
  { -a } -> std::convertible_to<T>;
  { sqrt(a) } -> std::convertible_to<T>;
  { atan2(a, b) } -> std::convertible_to<T>;
  { nearest(a) } -> std::convertible_to<T>;  // rounds the value; its derivative is zero
  { select(a > b, a, b) } -> std::convertible_to<T>;
  { all_finite(a) } -> std::convertible_to<bool>;
  T(c);
};

// sqrt whose derivative at zero is zero instead of infinite: the speed of a particle at rest.
template <class T>
T sqrt_or_zero(const T& a) {
  return select(a > T(0.0), sqrt(select(a > T(0.0), a, T(1.0))), T(0.0));
}

// 1/a where a is positive, otherwise 0.
template <class T>
T inverse_or_zero(const T& a) {
  const auto positive = a > T(0.0);
  return select(positive, T(1.0) / select(positive, a, T(1.0)), T(0.0));
}

}  // namespace sheetbend
