// Tangents of the block projection: derivatives of what the kernels of plain numbers compute, along eight directions at once. With J' for the
// derivative of J along the directions, z = W J^T dl and everything else that stands still, A dl = s gives
//   A dl' = s' - (a/(1+g))' dl - J' z - J z',  z' = W' J^T dl + W J'^T dl,
// so the matrix is factored once, in plain numbers, and J' lives no longer than its member is looked at. Kinds::of(kind) gives what a kind adds
// (sheetbend_blocks::TangentsOfKind).
#pragma once

#include "core/blocks/block_forward.h"
#include "core/packs/tangent.h"

namespace sheetbend {

template <class Kinds>
struct TangentKernels {
  using Block = sheetbend_blocks::Block;
  using Tangents = sheetbend_blocks::Tangents;

  // Reads x, lambda and dl before push() writes over them, and leaves z' in u.
  static void right_side(const Block& b, const Tangents& t) {
    Pack *u = numbers_of<Pack>(t.u), *right = numbers_of<Pack>(t.dl);
    const Pack* x = numbers_of<Pack>(static_cast<const double*>(t.x));
    for (int p = 0; p < b.particles; ++p) {
      const long at = sheetbend_blocks::row * static_cast<long>(p);
      (p < b.movable ? transpose_times_at<double>(b, p, b.dl) : Vec3<double>()).store(b.u + at);
      for (int d = 0; d < 3; ++d) u[at + d] = Pack(0.0);
    }
    for (int r = 0; r < b.run_count; ++r) Kinds::of(b.runs[r].kind).right_side(b, t, r);
    for (int p = 0; p < b.movable; ++p) {
      const long at = sheetbend_blocks::row * static_cast<long>(p);
      for (int d = 0; d < 3; ++d) u[at + d] = x[at + 3] * Pack(b.u[at + d]) + Pack(b.x[at + 3]) * u[at + d];
      for (int k = b.window[p]; k < b.window[p + 1]; ++k) {
        const double* G = b.gradients + sheetbend_blocks::row * static_cast<long>(k);
        right[b.rows[k]] -= Pack(G[0]) * u[at] + Pack(G[1]) * u[at + 1] + Pack(G[2]) * u[at + 2];
      }
    }
  }

  static void solve(const Block& b, double* right_side) {
    with_band(b.band,
              [&]<int Band>() { solve_band<Band>(b.size, b.band, b.matrix, b.inverse, numbers_of<Pack>(right_side)); });
  }

  static void push(const Block& b, const Tangents& t) {
    const Pack *dl = numbers_of<Pack>(t.dl), *u = numbers_of<Pack>(t.u);
    const Pack *x = numbers_of<Pack>(t.x), *lambda = numbers_of<Pack>(t.lambda);
    Pack *x_next = numbers_of<Pack>(t.x_next), *lambda_next = numbers_of<Pack>(t.lambda_next);
    for (int p = 0; p < b.particles; ++p) {
      const long at = sheetbend_blocks::row * static_cast<long>(p);
      for (int d = 0; d < 3; ++d) {
        Pack sum(0.0);
        if (p < b.movable) {
          for (int k = b.window[p]; k < b.window[p + 1]; ++k)
            sum += Pack(b.gradients[sheetbend_blocks::row * static_cast<long>(k) + d]) * dl[b.rows[k]];
          sum = u[at + d] + Pack(b.x[at + 3]) * sum;
        }
        x_next[at + d] = x[at + d] + sum;
      }
      x_next[at + 3] = x[at + 3];
    }
    for (int j = 0; j < b.size; ++j) lambda_next[j] = lambda[j] + dl[j];
  }

  static void values(const sheetbend_blocks::Values& b, const sheetbend_blocks::ValueTangents& t) {
    for (int r = 0; r < b.run_count; ++r)
      if (b.runs[r].damped) Kinds::of(b.runs[r].kind).values(b, t, r);
  }

  static void refer(const sheetbend_blocks::References& b, int size, const sheetbend_blocks::ReferenceTangents& t) {
    const Pack *C = numbers_of<Pack>(t.C), *C_before = numbers_of<Pack>(t.C_before);
    Pack* C_r = numbers_of<Pack>(t.C_r);
    for (int j = 0; j < size; ++j) C_r[j] = b.before == 0.0 ? C[j] : C[j] - Pack(b.before) * (C[j] - C_before[j]);
  }

  static constexpr sheetbend_blocks::TangentKernels all{&right_side, &solve, &push, &values, &refer};
};

}  // namespace sheetbend
