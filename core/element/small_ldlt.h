// LDL^T of a tiny symmetric matrix over any scalar, without pivoting: A is J W J^T plus a non-negative diagonal.
// A pivot below `least` of its row's own diagonal counts as zero (core/scalar/pivot.h).
#pragma once

#include "core/scalar/pivot.h"

namespace sheetbend {

template <int N, class T>
class SmallLdlt {
 public:
  // Takes the lower triangle of A, row-major.
  explicit SmallLdlt(const T* A, double least = 0.0) {
    for (int i = 0; i < N; ++i) {
      for (int j = 0; j < i; ++j) {
        T sum = A[i * N + j];
        for (int k = 0; k < j; ++k) sum -= L_[i][k] * D_[k] * L_[j][k];
        L_[i][j] = sum * inverse_[j];
      }
      T sum = A[i * N + i];
      for (int k = 0; k < i; ++k) sum -= L_[i][k] * L_[i][k] * D_[k];
      D_[i] = sum;
      inverse_[i] = inverse_pivot(sum, A[i * N + i], least);
    }
  }

  void solve(T* b) const {
    for (int i = 1; i < N; ++i)
      for (int k = 0; k < i; ++k) b[i] -= L_[i][k] * b[k];
    for (int i = 0; i < N; ++i) b[i] = b[i] * inverse_[i];
    for (int i = N - 1; i >= 0; --i)
      for (int k = i + 1; k < N; ++k) b[i] -= L_[k][i] * b[k];
  }

 private:
  T L_[N][N], D_[N], inverse_[N];
};

}  // namespace sheetbend
