// atan2 of our own, for doubles and lanes: a library's differs from machine to machine in the last bit and takes one lane at a time. It has no
// branch and only IEEE operations, so the bits are the same on every instruction set and in every lane.
#pragma once

namespace sheetbend {

inline double select(bool mask, double a, double b) { return mask ? a : b; }
inline double magnitude(double a) { return __builtin_fabs(a); }
inline double with_sign(double size, double sign) { return __builtin_copysign(size, sign); }

// (atan(t) / t - 1) / z in z = t^2, |t| <= 1/2, from a Remez exchange: atan is within 4e-18 of its size, a twentieth of its rounding.
template <class T>
T atan_polynomial(const T& z) {
  const T z2 = z * z, z4 = z2 * z2;
  const auto cubic = [&](double a, double b, double c, double d) { return (T(a) + T(b) * z) + (T(c) + T(d) * z) * z2; };
  const T low = cubic(-0.3333333333333298, 0.19999999999903162, -0.14285714276390069, 0.11111110659798819);
  const T mid = cubic(-0.0909089624838869, 0.07692073964270073, -0.06663811098333104, 0.05858301906153954);
  const T high = cubic(-0.05122018073874952, 0.04186536358085576, -0.02743543055177511, 0.010117163940055414);
  return low + z4 * (mid + z4 * high);
}

// The angle of (x, y) in [-pi, pi], within 2 units in the last place for |x|, |y| < 2^1023; signed zeros as IEEE 754 asks. It is `base`, a
// multiple of pi/4, and atan(t) from there, counted back where `sense` is -1. Above a half, t is (r - 1)/(1 + r), whose numerator is exact.
template <class T>
T angle_of(const T& y, const T& x) {
  constexpr double eighth = 0x1.921fb54442d18p-1, eighth_rest = 3.061616997868383e-17;  // of a turn; times 1 to 4 exact
  const T one(1.0), two(2.0), across = magnitude(x), up = magnitude(y);
  const auto steep = up > across;
  const T longer = select(steep, up, across), shorter = select(steep, across, up), sum = longer + shorter;
  const auto past = shorter > T(0.5) * longer;
  const T swapped = select(steep, T(-1.0), one), mirrored = with_sign(one, x), sense = swapped * mirrored;
  const T eighths = two - mirrored * (one + swapped * (one - select(past, one, T(0.0))));
  const T ratio = select(past, shorter - longer, shorter) / select(past, sum, longer);
  const T t = sense * select(longer > T(0.0), ratio, sum);  // what is not a number stays so
  const T z = t * t, bent = t * (z * atan_polynomial(z));
  const T base = T(eighth) * eighths, nearly = base + t, lost = t - (nearly - base);
  return with_sign(nearly + (lost + (bent + T(eighth_rest) * eighths)), y);
}

}  // namespace sheetbend
