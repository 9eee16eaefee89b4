// LDL^T of a symmetric band without pivoting, over any scalar. Column j stands at (band + j)(band + 1): its pivot, then the entries below it;
// `band` empty columns come before the first one, and as many zeros before the first inverse and after the last entry of a right side, so
// that no loop is cut short. Columns are kept as they are before the division by their pivot: l = column / pivot.
#pragma once

#include <iterator>

#include "core/scalar/pivot.h"

namespace sheetbend {

inline constexpr int max_band = 64;
inline constexpr int band_padding = 3;  // numbers after the last column that a vector of four may touch
inline constexpr int unrolled_bands[] = {1, 2, 5, 10, 15};  // 15: bodies on hinges

// The width that a band is stored with: one that the compiler has unrolled, where there is one.
inline int stored_band(int band) {
  for (const int b : unrolled_bands)
    if (band <= b) return b;
  return band;
}

// Calls f with the band as a constant, or with 0 where it is not among the unrolled ones.
template <int I = 0, class F>
void with_band(int band, F&& f) {
  if constexpr (I < std::size(unrolled_bands)) {
    if (band == unrolled_bands[I]) return f.template operator()<unrolled_bands[I]>();
    with_band<I + 1>(band, f);
  } else {
    f.template operator()<0>();
  }
}

// Left-looking: a column takes what all columns before it have for it while it stands in registers. Its pivot waits for that of the column
// before, which therefore comes last, with as little as can be after its division.
template <int Band, class T>
void factorize_band(int n, int any_band, T* A, T* inverse) {
  const int band = Band > 0 ? Band : any_band;
  A += band * (band + 1);
  inverse += band;
  for (int j = 0; j < n; ++j) {
    T* column = A + static_cast<long>(j) * (band + 1);
    T sum[(Band > 0 ? Band : max_band) + 1]{};
    for (int i = 0; i <= band; ++i) sum[i] = column[i];
    const T diagonal = sum[0];
#pragma GCC unroll 16
    for (int k = band; k >= 2; --k) {
      const T* left = column - static_cast<long>(k) * (band + 1);
      const T l = left[k] * inverse[j - k];
#pragma GCC unroll 17
      for (int i = k; i <= band; ++i) sum[i - k] -= l * left[i];
    }
    const T* left = column - (band + 1);
#pragma GCC unroll 17
    for (int i = 1; i <= band; ++i) sum[i - 1] -= (left[1] * left[i]) * inverse[j - 1];
    inverse[j] = inverse_pivot(sum[0], diagonal);
    for (int i = 0; i <= band; ++i) column[i] = sum[i];
  }
}

// A right side may be of another scalar than the matrix: eight of them in lanes.
template <int Band, class T, class U>
void solve_band(int n, int any_band, const T* A, const T* inverse, U* b) {
  const int band = Band > 0 ? Band : any_band;
  A += band * (band + 1);
  inverse += band;
  for (int j = 0; j < n; ++j) {
    const T* column = A + static_cast<long>(j) * (band + 1);
    const U t = b[j] * inverse[j];
#pragma GCC unroll 16
    for (int i = 1; i <= band; ++i) b[j + i] -= column[i] * t;
    b[j] = t;
  }
  for (int j = n - 1; j >= 0; --j) {
    const T* column = A + static_cast<long>(j) * (band + 1);
    // The entry that was found last comes last: it is what the others wait for.
    U even(0.0), odd(0.0);
#pragma GCC unroll 16
    for (int i = band; i > 1; --i) (i % 2 ? odd : even) += column[i] * b[j + i];
    b[j] -= inverse[j] * ((even + odd) + column[1] * b[j + 1]);
  }
}

}  // namespace sheetbend
