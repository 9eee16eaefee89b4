// LDL^T of the matrix of a direct block, over any scalar and without pivoting. The structure is found once; banded for chains
// (O(n) with a small constant), sparse for branches and loops (Davis 2005, up-looking, after an ordering that keeps fill low).
#pragma once

#include <utility>
#include <vector>

#include "core/blocks/band.h"

namespace sheetbend {

// The pattern: which entries of the lower triangle exist and where their values stand.
class FactorStructure {
 public:
  // entries: (row, column) pairs of the lower triangle in elimination order, duplicates allowed; the diagonal is always there.
  FactorStructure(int n, const std::vector<std::pair<int, int>>& entries, bool may_be_banded = true);

  int size() const { return n_; }
  bool banded() const { return banded_; }
  int half_bandwidth() const { return band_; }
  int stored_band() const { return sheetbend::stored_band(band_); }
  std::size_t values() const;
  std::size_t position(int row, int column) const;  // row >= column
  std::size_t fill() const { return banded_ ? static_cast<std::size_t>(n_) * (band_ + 1) : column_start_.back(); }

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
  std::vector<T> values;   // A on entry, by FactorStructure::position
  std::vector<T> inverse;  // of the pivots, after as many zeros as the stored band is wide

  // A right side of a band is as long as the matrix and the stored band, with zeros at the end.
  static std::size_t right_side(const FactorStructure& s) { return s.banded_ ? s.n_ + s.stored_band() : s.n_; }

  void reset(const FactorStructure& s) {
    values.assign(s.values(), T(0.0));
    inverse.assign(right_side(s), T(0.0));
  }

  void factorize(const FactorStructure& s) {
    if (!s.banded_) return factorize_sparse(s);
    with_band(s.stored_band(),
              [&]<int Band>() { factorize_band<Band>(s.n_, s.stored_band(), values.data(), inverse.data()); });
  }

  template <class U>
  void solve(const FactorStructure& s, U* b) const {
    if (!s.banded_) return solve_sparse(s, b);
    with_band(s.stored_band(),
              [&]<int Band>() { solve_band<Band>(s.n_, s.stored_band(), values.data(), inverse.data(), b); });
  }

 private:
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
        const T l = y * inverse[j];
        pivot -= l * y;
        lower_[end] = l;
        lower_row_[end] = i;
        ++used_[j];
      }
      inverse[i] = inverse_pivot(pivot);
    }
  }

  template <class U>
  void solve_sparse(const FactorStructure& s, U* b) const {
    for (int j = 0; j < s.n_; ++j)
      for (int q = s.column_start_[j]; q < s.column_start_[j + 1]; ++q) b[lower_row_[q]] -= lower_[q] * b[j];
    for (int j = 0; j < s.n_; ++j) b[j] = b[j] * inverse[j];
    for (int j = s.n_ - 1; j >= 0; --j)
      for (int q = s.column_start_[j]; q < s.column_start_[j + 1]; ++q) b[j] -= lower_[q] * b[lower_row_[q]];
  }

  std::vector<T> lower_, work_;
  std::vector<int> lower_row_, used_;
};

}  // namespace sheetbend
