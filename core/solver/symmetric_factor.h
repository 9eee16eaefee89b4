// LDL^T of the matrix of a direct block, over any scalar and without pivoting. The structure is found once; banded for chains
// (O(n) with a small constant), sparse for branches and loops (Davis 2005, up-looking, after an ordering that keeps fill low).
#pragma once

#include <utility>
#include <vector>

#include "core/scalar/scalar.h"

namespace sheetbend {

// The pattern: which entries of the lower triangle exist and where their values stand.
class FactorStructure {
 public:
  // entries: (row, column) pairs of the lower triangle in elimination order, duplicates allowed; the diagonal is always there.
  FactorStructure(int n, const std::vector<std::pair<int, int>>& entries);

  int size() const { return n_; }
  bool banded() const { return banded_; }
  int half_bandwidth() const { return band_; }
  std::size_t values() const { return banded_ ? static_cast<std::size_t>(n_) * (band_ + 1) : row_start_.back(); }
  std::size_t position(int row, int column) const;  // row >= column
  std::size_t fill() const { return banded_ ? values() : column_start_.back(); }

 private:
  template <class T>
  friend class Factor;
  void build_sparse(const std::vector<std::pair<int, int>>& entries);

  int n_ = 0, band_ = 0;
  bool banded_ = true;
  std::vector<int> row_start_, row_column_;   // lower triangle of A by rows (sparse only), diagonal last in its row
  std::vector<int> pattern_start_, pattern_;  // columns of each row of L, in an order in which they can be eliminated
  std::vector<int> column_start_;             // L by columns
};

template <class T>
class Factor {
 public:
  std::vector<T> values;  // A on entry, by FactorStructure::position

  void reset(const FactorStructure& s) {
    values.assign(s.values(), T(0.0));
    inverse_.resize(s.n_);
  }

  void factorize(const FactorStructure& s) { s.banded_ ? factorize_banded(s) : factorize_sparse(s); }

  void solve(const FactorStructure& s, T* b) const { s.banded_ ? solve_banded(s, b) : solve_sparse(s, b); }

 private:
  static T inverse_pivot(const T& d) {
    const auto movable = d > T(0.0);
    return select(movable, T(1.0) / select(movable, d, T(1.0)), T(0.0));
  }

  // Right-looking by rows of the trailing band: the inner loop runs over contiguous values.
  void factorize_banded(const FactorStructure& s) {
    const int n = s.n_, band = s.band_;
    T scaled[max_band];
    for (int j = 0; j < n; ++j) {
      const T inverse = inverse_pivot(at(s, j, j));
      inverse_[j] = inverse;
      const int last = j + band < n ? j + band : n - 1;
      for (int i = j + 1; i <= last; ++i) scaled[i - j] = at(s, i, j);
      for (int i = j + 1; i <= last; ++i) {
        const T l = scaled[i - j] * inverse;
        T* row = &values[static_cast<std::size_t>(i) * (band + 1) + band - i];
        for (int k = j + 1; k <= i; ++k) row[k] -= l * scaled[k - j];
        row[j] = l;
      }
    }
  }

  void solve_banded(const FactorStructure& s, T* b) const {
    const int n = s.n_, band = s.band_;
    for (int i = 0; i < n; ++i) {
      const T* row = &values[static_cast<std::size_t>(i) * (band + 1) + band - i];
      for (int k = i > band ? i - band : 0; k < i; ++k) b[i] -= row[k] * b[k];
    }
    for (int i = 0; i < n; ++i) b[i] = b[i] * inverse_[i];
    for (int i = n - 1; i >= 0; --i) {
      const T* row = &values[static_cast<std::size_t>(i) * (band + 1) + band - i];
      for (int k = i > band ? i - band : 0; k < i; ++k) b[k] -= row[k] * b[i];
    }
  }

  void factorize_sparse(const FactorStructure& s) {
    lower_.resize(s.column_start_.back());
    lower_row_.resize(s.column_start_.back());
    used_.assign(s.n_, 0);
    work_.assign(s.n_, T(0.0));
    for (int i = 0; i < s.n_; ++i) {
      for (int p = s.row_start_[i]; p < s.row_start_[i + 1]; ++p) work_[s.row_column_[p]] = values[p];
      T pivot = work_[i];
      work_[i] = T(0.0);
      for (int p = s.pattern_start_[i]; p < s.pattern_start_[i + 1]; ++p) {
        const int j = s.pattern_[p];
        const T y = work_[j];
        work_[j] = T(0.0);
        const int begin = s.column_start_[j], end = begin + used_[j];
        for (int q = begin; q < end; ++q) work_[lower_row_[q]] -= lower_[q] * y;
        const T l = y * inverse_[j];
        pivot -= l * y;
        lower_[end] = l;
        lower_row_[end] = i;
        ++used_[j];
      }
      inverse_[i] = inverse_pivot(pivot);
    }
  }

  void solve_sparse(const FactorStructure& s, T* b) const {
    for (int j = 0; j < s.n_; ++j)
      for (int q = s.column_start_[j]; q < s.column_start_[j + 1]; ++q) b[lower_row_[q]] -= lower_[q] * b[j];
    for (int j = 0; j < s.n_; ++j) b[j] = b[j] * inverse_[j];
    for (int j = s.n_ - 1; j >= 0; --j)
      for (int q = s.column_start_[j]; q < s.column_start_[j + 1]; ++q) b[j] -= lower_[q] * b[lower_row_[q]];
  }

  T& at(const FactorStructure& s, int i, int j) {
    return values[static_cast<std::size_t>(i) * (s.band_ + 1) + s.band_ - i + j];
  }

 public:
  static constexpr int max_band = 64;

 private:
  std::vector<T> inverse_, lower_, work_;
  std::vector<int> lower_row_, used_;
};

}  // namespace sheetbend
