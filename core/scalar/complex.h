// Complex numbers for the complex step: f(x + i e) = f(x) + i e f'(x), exact to rounding for e near 1e-40 (Squire & Trapp 1998).
// Comparisons look at the real part, products are plain (no conjugates).
#pragma once

#include <complex>

#include "core/scalar/scalar.h"

namespace sheetbend {

struct Complex {
  double re = 0.0, im = 0.0;
  Complex() = default;
  Complex(double real, double imag = 0.0) : re(real), im(imag) {}
  Complex& operator+=(const Complex& b) { return re += b.re, im += b.im, *this; }
  Complex& operator-=(const Complex& b) { return re -= b.re, im -= b.im, *this; }
  Complex& operator*=(const Complex& b) { return *this = Complex(re * b.re - im * b.im, re * b.im + im * b.re); }
};

inline Complex operator-(const Complex& a) { return {-a.re, -a.im}; }
inline Complex operator+(Complex a, const Complex& b) { return a += b; }
inline Complex operator-(Complex a, const Complex& b) { return a -= b; }
inline Complex operator*(Complex a, const Complex& b) { return a *= b; }
inline Complex operator/(const Complex& a, const Complex& b) {
  const double n = b.re * b.re + b.im * b.im;
  return {(a.re * b.re + a.im * b.im) / n, (a.im * b.re - a.re * b.im) / n};
}
inline bool operator>(const Complex& a, const Complex& b) { return a.re > b.re; }
inline bool operator<(const Complex& a, const Complex& b) { return a.re < b.re; }

inline Complex sqrt(const Complex& a) {
  const std::complex<double> r = std::sqrt(std::complex<double>(a.re, a.im));
  return {r.real(), r.imag()};
}
inline Complex sin(const Complex& a) { return {std::sin(a.re) * std::cosh(a.im), std::cos(a.re) * std::sinh(a.im)}; }
inline Complex cos(const Complex& a) { return {std::cos(a.re) * std::cosh(a.im), -std::sin(a.re) * std::sinh(a.im)}; }
inline Complex log(const Complex& a) { return {std::log(std::hypot(a.re, a.im)), std::atan2(a.im, a.re)}; }
// The analytic continuation along the real branch, to first order in the imaginary parts (which is all a complex step sees).
inline Complex atan2(const Complex& y, const Complex& x) {
  return {atan2(y.re, x.re), (x.re * y.im - y.re * x.im) / (x.re * x.re + y.re * y.re)};
}
inline Complex nearest(const Complex& a) { return {std::nearbyint(a.re), 0.0}; }
inline Complex select(bool mask, const Complex& a, const Complex& b) { return mask ? a : b; }
inline bool all_finite(const Complex& a) { return std::isfinite(a.re) && std::isfinite(a.im); }
inline double value_of(const Complex& a) { return a.re; }

}  // namespace sheetbend
