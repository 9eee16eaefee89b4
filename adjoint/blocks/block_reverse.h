// The reverse kernels of a direct block over a scalar T. Kinds::of(kind) gives what a kind adds (sheetbend_blocks::ReverseOfKind).
#pragma once

#include "core/blocks/block_forward.h"

namespace sheetbend {

template <class T, class Kinds>
struct ReverseKernels {
  using Block = sheetbend_blocks::Block;

  static void right_side(const Block& b) {
    T* y = numbers_of<T>(b.y);
    for (int j = 0; j < b.size; ++j) y[j] = numbers_of<T>(b.lambda_bar)[j];
    for (int p = 0; p < b.movable; ++p) {
      const long at = sheetbend_blocks::row * static_cast<long>(p);
      const Vec3<T> dx = numbers_of<T>(b.x)[at + 3] * Vec3<T>(numbers_of<T>(b.x_bar) + at);
      for (int k = b.window[p]; k < b.window[p + 1]; ++k)
        y[b.rows[k]] += dot(Vec3<T>(numbers_of<T>(b.gradients) + sheetbend_blocks::row * static_cast<long>(k)), dx);
    }
  }

  static void spread(const Block& b) {
    for (int p = 0; p < b.particles; ++p) {
      const long at = sheetbend_blocks::row * static_cast<long>(p);
      T* x_bar = numbers_of<T>(b.x_bar) + at;
      const Vec3<T> z = Vec3<T>(x_bar) - transpose_times_at(b, p, numbers_of<T>(b.y));
      z.store(x_bar);
      if (p >= b.movable) continue;
      z.store(numbers_of<T>(b.z) + at);
      x_bar[3] += dot(Vec3<T>(numbers_of<T>(b.u) + at), z);
    }
  }

  static void pull_back(const Block& b) {
    for (int r = 0; r < b.run_count; ++r) Kinds::of(b.runs[r].kind).pull_back(b, b.runs[r]);
  }

  static void values(const sheetbend_blocks::Values& b) {
    for (int r = 0; r < b.run_count; ++r)
      if (b.runs[r].damped) Kinds::of(b.runs[r].kind).values(b, b.runs[r]);
  }

  static constexpr sheetbend_blocks::Reverse all{&right_side, &spread, &pull_back, &values};
};

}  // namespace sheetbend
