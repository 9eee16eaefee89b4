// LU of one 3 x 3 block with its rows exchanged, largest first. Others are divided by it and not multiplied by its inverse: where one direction of a particle
// is far stiffer than the rest, as of a rod's director, the inverse has lost the digits of the soft ones.
#pragma once

#include <cmath>
#include <utility>

namespace sheetbend {

struct PivotBlock {
  double entries[9];  // row by row: the block, then L below the diagonal and U
  int from[3];        // of the factored rows, the rows of the block

  // Says whether the block has an inverse.
  bool factorize() {
    double* M = entries;
    for (int a = 0; a < 3; ++a) from[a] = a;
    for (int k = 0; k < 3; ++k) {
      int largest = k;
      for (int a = k + 1; a < 3; ++a)
        if (std::abs(M[3 * a + k]) > std::abs(M[3 * largest + k])) largest = a;
      std::swap(from[k], from[largest]);
      for (int b = 0; b < 3; ++b) std::swap(M[3 * k + b], M[3 * largest + b]);
      if (!(std::abs(M[4 * k]) > 0.0) || !std::isfinite(M[4 * k])) return false;
      for (int a = k + 1; a < 3; ++a) {
        M[3 * a + k] /= M[4 * k];
        for (int b = k + 1; b < 3; ++b) M[3 * a + b] -= M[3 * a + k] * M[3 * k + b];
      }
    }
    return true;
  }

  // b <- A^-1 b
  template <class U>
  void solve(U* b) const {
    const double* M = entries;
    const U x = b[from[0]], y = b[from[1]] - M[3] * x, z = b[from[2]] - M[6] * x - M[7] * y;
    b[2] = z / M[8];
    b[1] = (y - M[5] * b[2]) / M[4];
    b[0] = (x - M[1] * b[1] - M[2] * b[2]) / M[0];
  }
  // b <- A^-T b; of a row, b A^-1
  template <class U>
  void solve_transposed(U* b) const {
    const double* M = entries;
    const U x = b[0] / M[0], y = (b[1] - M[1] * x) / M[4], z = (b[2] - M[2] * x - M[5] * y) / M[8];
    const U second = y - M[7] * z, first = x - M[3] * second - M[6] * z;
    b[from[0]] = first, b[from[1]] = second, b[from[2]] = z;
  }
};

}  // namespace sheetbend
