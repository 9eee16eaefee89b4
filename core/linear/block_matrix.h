// A symmetric matrix of 3 x 3 blocks: products, and sweeps of Gauss-Seidel. Its lower triangle stands by rows, so that each of them passes over it
// once; P are its numbers, V those of vectors.
#pragma once

#include "core/scalar/vec3.h"

namespace sheetbend {

template <class P>
struct BlockMatrix {
  const int *start, *column;  // per row its blocks, the diagonal one last
  const P* blocks;            // nine numbers each, row by row
  const P* inverse;           // of the diagonal blocks: six numbers each
  int rows;

  // q = H p
  template <class V>
  void multiply(const V* p, V* q) const {
    for (int i = 0; i < rows; ++i) {
      const int diagonal = start[i + 1] - 1;
      const Vec3<V> own = vector(p, i);
      Vec3<V> sum = times(diagonal, own);
      for (int k = start[i]; k < diagonal; ++k) {
        sum = sum + times(k, vector(p, column[k]));
        transpose_times(k, own).add_to(q + 3 * static_cast<long>(column[k]));
      }
      sum.store(q + 3 * static_cast<long>(i));
    }
  }

  // z = (L + D)^-1 r, L being H below the diagonal; rest = r - H z.
  template <class V>
  void sweep_forward(const V* r, V* z, V* rest) const {
    for (int i = 0; i < rows; ++i) {
      const int diagonal = start[i + 1] - 1;
      Vec3<V> sum = vector(r, i);
      for (int k = start[i]; k < diagonal; ++k) sum = sum - times(k, vector(z, column[k]));
      const Vec3<V> own = inverse_times(i, sum);
      own.store(z + 3 * static_cast<long>(i));
      Vec3<V>(V(0.0), V(0.0), V(0.0)).store(rest + 3 * static_cast<long>(i));
      for (int k = start[i]; k < diagonal; ++k) subtract(transpose_times(k, own), rest, column[k]);
    }
  }

  // Row by row from the last one on: what z_i has to be where the others are what they are. `later` is scratch.
  template <class V>
  void sweep_backward(const V* r, V* z, V* later) const {
    for (long d = 0; d < 3 * static_cast<long>(rows); ++d) later[d] = r[d];
    for (int i = rows - 1; i >= 0; --i) {
      const int diagonal = start[i + 1] - 1;
      Vec3<V> before(V(0.0), V(0.0), V(0.0));  // does not wait for the row that was done last
      for (int k = diagonal - 1; k >= start[i]; --k) before = before + times(k, vector(z, column[k]));
      const Vec3<V> own = inverse_times(i, vector(later, i) - before);
      own.store(z + 3 * static_cast<long>(i));
      for (int k = diagonal - 1; k >= start[i]; --k) subtract(transpose_times(k, own), later, column[k]);
    }
  }

 private:
  template <class V>
  static Vec3<V> vector(const V* a, int i) {
    return Vec3<V>(a + 3 * static_cast<long>(i));
  }
  template <class V>
  static void subtract(const Vec3<V>& b, V* a, int i) {
    (vector(a, i) - b).store(a + 3 * static_cast<long>(i));
  }
  template <class V>
  Vec3<V> times(int k, const Vec3<V>& z) const {
    const P* B = blocks + 9 * static_cast<long>(k);
    return {B[0] * z.x + B[1] * z.y + B[2] * z.z, B[3] * z.x + B[4] * z.y + B[5] * z.z,
            B[6] * z.x + B[7] * z.y + B[8] * z.z};
  }
  template <class V>
  Vec3<V> transpose_times(int k, const Vec3<V>& z) const {
    const P* B = blocks + 9 * static_cast<long>(k);
    return {B[0] * z.x + B[3] * z.y + B[6] * z.z, B[1] * z.x + B[4] * z.y + B[7] * z.z,
            B[2] * z.x + B[5] * z.y + B[8] * z.z};
  }
  template <class V>
  Vec3<V> inverse_times(int i, const Vec3<V>& r) const {
    const P* M = inverse + 6 * static_cast<long>(i);
    return {M[0] * r.x + M[1] * r.y + M[2] * r.z, M[1] * r.x + M[3] * r.y + M[4] * r.z,
            M[2] * r.x + M[4] * r.y + M[5] * r.z};
  }
};

}  // namespace sheetbend
