// The band of plain numbers, four entries of a column at a time. An entry sees the operations of band.h and block_forward.h in their order, and has
// the same bits; what does not belong to a column adds zeros, or takes them off.
#pragma once

#include "core/blocks/band.h"
#include "core/packs/lanes.h"
#include "core/scalar/unrolled.h"

namespace sheetbend {

#ifdef __AVX__
inline constexpr bool has_fours = true;
#else
inline constexpr bool has_fours = false;
#endif

// Narrower ones wait for what was stored by other fours.
inline constexpr int least_band_in_fours = 8;

typedef double Four __attribute__((vector_size(32), aligned(8), may_alias));

// Four entries from number `first` on of a column of fours, which zeros follow.
template <int first, int fours>
inline __attribute__((always_inline)) Row four_from(const Row* x) {
  constexpr int c = first / 4, i = first % 4;
  return __builtin_shufflevector(x[c], c + 1 < fours ? x[c + 1] : Row{}, i, i + 1, i + 2, i + 3);
}

// add_window() of block_forward.h: what stands below the window adds a zero. Every column is added to in the same pieces: a load of what several
// stores still under way have left waits for all of them.
template <int Band>
void add_window_by_fours(const double* G, int count, double w, double* columns) {
  typedef double Pair __attribute__((vector_size(16), aligned(8), may_alias));
  constexpr int fours = Band / 4 + 1;
  Row x[fours], y[fours], z[fours];
  for (int c = 0; c < fours; ++c) {
    Row rows[4];
    for (int i = 0; i < 4; ++i) rows[i] = 4 * c + i < count ? row_at(G, 16 * c + 4 * i) : Row{};
    const Row xz01 = __builtin_shufflevector(rows[0], rows[1], 0, 4, 2, 6);
    const Row xz23 = __builtin_shufflevector(rows[2], rows[3], 0, 4, 2, 6);
    const Row yw01 = __builtin_shufflevector(rows[0], rows[1], 1, 5, 3, 7);
    const Row yw23 = __builtin_shufflevector(rows[2], rows[3], 1, 5, 3, 7);
    x[c] = __builtin_shufflevector(xz01, xz23, 0, 1, 4, 5);
    y[c] = __builtin_shufflevector(yw01, yw23, 0, 1, 4, 5);
    z[c] = __builtin_shufflevector(xz01, xz23, 2, 3, 6, 7);
  }
  unrolled<Band + 1>([&](auto k) __attribute__((always_inline)) {
    if (k >= count) return;
    double* column = columns + k * (Band + 1);
    const double wx = w * G[4 * k], wy = w * G[4 * k + 1], wz = w * G[4 * k + 2];
    unrolled<fours>([&](auto c) __attribute__((always_inline)) {
      constexpr int i = 4 * c, left = Band + 1 - i;
      if constexpr (k + i <= Band) {
        const Row by =
            wx * four_from<k + i, fours>(x) + wy * four_from<k + i, fours>(y) + wz * four_from<k + i, fours>(z);
        if constexpr (left >= 4) {
          *reinterpret_cast<Four*>(column + i) += by;
        } else {
          if constexpr (left >= 2) *reinterpret_cast<Pair*>(column + i) += __builtin_shufflevector(by, by, 0, 1);
          if constexpr (left % 2) column[i + left - 1] += by[left - 1];
        }
      }
    });
  });
}

// The first `count` of four numbers, and zeros.
template <int count>
inline __attribute__((always_inline)) Row first_of_four(const double* from) {
  typedef long long Bits __attribute__((vector_size(32)));
  const Row r = *reinterpret_cast<const Four*>(from);
  if constexpr (count >= 4) return r;
  return Row(Bits(r) & Bits{-(count > 0), -(count > 1), -(count > 2), 0});
}

// A column that stands in registers, and the same from its entry 1 or 2 on.
template <int Band>
struct ColumnInFours {
  static constexpr int fours = Band / 4 + 1;
  Row at[fours]{};

  Row next(int c) const { return c < fours ? at[c] : Row{}; }
  Row from_1(int c) const { return __builtin_shufflevector(next(c), next(c + 1), 1, 2, 3, 4); }
  Row from_2(int c) const { return __builtin_shufflevector(next(c), next(c + 1), 2, 3, 4, 5); }
};

// The two columns before stay in registers: their entries are wanted before they could be loaded from where they were stored by other fours.
template <int Band>
void factorize_band_by_fours(int n, double* A, double* inverse) {
  constexpr int fours = ColumnInFours<Band>::fours;
  A += Band * (Band + 1);
  inverse += Band;
  ColumnInFours<Band> before, before_that;
  for (int j = 0; j < n; ++j) {
    double* column = A + static_cast<long>(j) * (Band + 1);
    ColumnInFours<Band> sum;
    unrolled<fours>([&](auto c) { sum.at[c] = first_of_four<Band + 1 - 4 * c>(column + 4 * c); });
    const double diagonal = column[0];
    unrolled<Band - 2>([&](auto done) {
      constexpr int k = Band - decltype(done)::value;
      const double* left = column - static_cast<long>(k) * Band;
      const double l = left[0] * inverse[j - k];
      unrolled<(Band - k) / 4 + 1>([&](auto c) { sum.at[c] -= l * first_of_four<Band - k + 1 - 4 * c>(left + 4 * c); });
    });
    const double l = before_that.at[0][2] * inverse[j - 2], first = before.at[0][1];
#pragma GCC unroll 5
    for (int c = 0; c < fours; ++c) sum.at[c] -= l * before_that.from_2(c);
#pragma GCC unroll 5
    for (int c = 0; c < fours; ++c) sum.at[c] -= (first * before.from_1(c)) * inverse[j - 1];
    inverse[j] = inverse_pivot(sum.at[0][0], diagonal);
#pragma GCC unroll 5
    for (int c = 0; c < fours; ++c)
      for (int i = 0; i < 4 && 4 * c + i <= Band; ++i) column[4 * c + i] = sum.at[c][i];
    before_that = before;
    before = sum;
  }
}

}  // namespace sheetbend
