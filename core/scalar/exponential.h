// exp, and (exp - 1)/t, of our own over any scalar: a library's differ from machine to machine in the last bit and take one lane at a time.
// No branch and only IEEE operations, so the bits are the same on every instruction set and in every lane.
#pragma once

#include <limits>

#include "core/scalar/complex.h"
#include "core/scalar/dual.h"
#include "core/scalar/pack.h"

namespace sheetbend {

// 2^k of a whole number k in [-1022, 1023]: the low bits of 1.5 * 2^52 + k are k.
inline double two_to(double k) {
  return __builtin_bit_cast(double, (__builtin_bit_cast(unsigned long long, k + 0x1.8p52) + 1023) << 52);
}
template <int N>
Lanes<N> two_to(const Lanes<N>& k) {
  using L = Lanes<N>;
  return L::map(k, k, [](const typename L::Vector& x, const typename L::Vector&) {
    return typename L::Vector((typename L::Bits(x + 0x1.8p52) + 1023) << 52);
  });
}
inline Complex two_to(const Complex& k) { return two_to(k.re); }
template <class T, int N>
Dual<T, N> two_to(const Dual<T, N>& k) {
  return Dual<T, N>(two_to(k.v));
}

// t = k ln 2 + r with |r| <= ln 2 / 2, and exp(t) = 2^k (1 + r q(r)) by Taylor's series of q, whose derivatives are as near as its value.
// Infinite above ln of the largest double, zero far below.
template <class T>
struct Exponential {
  T value;       // exp(t)
  T mean_slope;  // (exp(t) - 1)/t, one at zero

  explicit Exponential(const T& t) {
    const T one(1.0), zero(0.0);
    const T whole = nearest(T(1.4426950408889634074) * t);
    const T r = (t - T(0x1.62e42feep-1) * whole) - T(1.908214929270587700e-10) * whole;
    constexpr int terms = 17;
    T q(0.0);
    for (int i = terms; i >= 1; --i) q = (one + r * q) * T(1.0 / (i + 1));
    q = one + r * q;
    const auto over = whole > T(1023.0), under = T(-1022.0) > whole;
    const T power = two_to(select(over, zero, select(under, zero, whole)));
    const T scale = select(over, T(std::numeric_limits<double>::infinity()), select(under, zero, power));
    const T grown = scale * (r * q);
    value = scale + grown;
    const auto near = T(0.5) > select(whole > zero, whole, -whole);
    mean_slope = select(near, q, (grown + (scale - one)) / select(near, one, t));
  }
};

}  // namespace sheetbend
