// The forward kernels of a direct block over a scalar T. Kinds::of(kind) gives what a kind adds (sheetbend_blocks::ForwardOfKind).
#pragma once

#include "core/blocks/fours.h"
#include "core/blocks/supernodes.h"
#include "core/blocks/wide.h"

namespace sheetbend {

// A += w G G^T of one particle's `count` gradient rows G, which follow one another from `column` on.
template <class T>
void add_window(const T* G, int count, const T& w, int band, T* column) {
  for (int k = 0; k < count; ++k, column += band + 1) {
    const T *Gk = G + 4 * k, wx = w * Gk[0], wy = w * Gk[1], wz = w * Gk[2];
    for (int i = 0; i < count - k; ++i) {
      const T* Gi = Gk + 4 * i;
      column[i] += wx * Gi[0] + wy * Gi[1] + wz * Gi[2];
    }
  }
}

// J^T b of one particle.
template <class T>
Vec3<T> transpose_times_at(const sheetbend_blocks::Block& block, int particle, const T* b) {
  Vec3<T> sum;
  for (int k = block.window[particle]; k < block.window[particle + 1]; ++k)
    sum = sum + b[block.rows[k]] * Vec3<T>(numbers_of<T>(block.gradients) + sheetbend_blocks::row * k);
  return sum;
}

template <class T, class Kinds>
struct ForwardKernels {
  using Block = sheetbend_blocks::Block;

  static void evaluate(const Block& b) {
    for (int r = 0; r < b.run_count; ++r) Kinds::of(b.runs[r].kind).evaluate(b, b.runs[r]);
  }

  static void factor(const Block& b) {
    T *A = numbers_of<T>(b.matrix), *inverse = numbers_of<T>(b.inverse);
    const T *diagonal = numbers_of<T>(b.diagonal), *x = numbers_of<T>(b.x), *G = numbers_of<T>(b.gradients);
    with_band(b.band, [&]<int Band>() {
      const int band = b.band;
      T* columns = A + band * (band + 1);
      for (int j = 0; j < b.size; ++j) {
        T* column = columns + static_cast<long>(j) * (band + 1);
        column[0] = diagonal[j];
        for (int i = 1; i <= band; ++i) column[i] = T(0.0);
      }
      for (int p = 0; p < b.movable; ++p) {
        const int begin = b.window[p];
        const int count = b.window[p + 1] - begin;
        const T *rows = G + sheetbend_blocks::row * static_cast<long>(begin), w = x[sheetbend_blocks::row * p + 3];
        T* to = columns + static_cast<long>(b.rows[begin]) * (band + 1);
        if constexpr (members_in_lanes<T> && has_fours && Band > 0)
          add_window_by_fours<Band>(rows, count, w, to);
        else
          add_window(rows, count, w, band, to);
      }
      if constexpr (members_in_lanes<T> && has_fours && Band >= least_band_in_fours)
        factorize_band_by_fours<Band>(b.size, A, inverse);
      else
        factorize_band<Band>(b.size, band, A, inverse);
    });
  }

  static void solve(const Block& b, double* right_side) {
    with_band(b.band, [&]<int Band>() {
      solve_band<Band>(b.size, b.band, numbers_of<T>(b.matrix), numbers_of<T>(b.inverse), numbers_of<T>(right_side));
    });
  }

  static void push(const Block& b) {
    const T* dl = numbers_of<T>(b.dl);
    for (int p = 0; p < b.particles; ++p) {
      const long at = sheetbend_blocks::row * static_cast<long>(p);
      const T* x = numbers_of<T>(b.x) + at;
      T *u = numbers_of<T>(b.u) + at, *x_next = numbers_of<T>(b.x_next) + at;
      const T w = x[3];
      const Vec3<T> push = p < b.movable ? transpose_times_at(b, p, dl) : Vec3<T>();
      push.store(u);
      (Vec3<T>(x) + w * push).store(x_next);
      x_next[3] = w;
    }
    for (int j = 0; j < b.size; ++j) numbers_of<T>(b.lambda_next)[j] = numbers_of<T>(b.lambda)[j] + dl[j];
  }

  static void values(const sheetbend_blocks::Values& b) {
    for (int r = 0; r < b.run_count; ++r)
      if (b.runs[r].damped) Kinds::of(b.runs[r].kind).values(b, b.runs[r]);
  }

  static void refer(const sheetbend_blocks::References& b) {
    for (int r = 0; r < b.run_count; ++r)
      if (b.runs[r].damped) Kinds::of(b.runs[r].kind).refer(b, b.runs[r]);
  }

  static void factor_supernodes(const sheetbend_blocks::Supernodes& s, double* panels, double* inverse, double* work,
                                int* place) {
    SupernodalFactor<T>{s, numbers_of<T>(panels), numbers_of<T>(inverse), numbers_of<T>(work), place}.factorize();
  }

  static constexpr sheetbend_blocks::Forward all{&evaluate, &factor,           &solve, &push, &values,
                                                 &refer,    &factor_supernodes};
};

}  // namespace sheetbend
