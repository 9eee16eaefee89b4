#include "core/solver/symmetric_factor.h"

#include <algorithm>
#include <stdexcept>

namespace sheetbend {

FactorStructure::FactorStructure(int n, const std::vector<std::pair<int, int>>& entries, bool may_be_banded) : n_(n) {
  std::size_t nonzeros = 0;
  for (const auto& [row, column] : entries) {
    band_ = std::max(band_, row - column);
    nonzeros += row != column;
  }
  // A band pays while it is not much emptier than the matrix.
  banded_ = may_be_banded && band_ <= max_band && static_cast<std::size_t>(n) * band_ <= 4 * nonzeros + 64;
  if (!banded_) build_sparse(entries);
}

void FactorStructure::build_sparse(const std::vector<std::pair<int, int>>& entries) {
  std::vector<std::vector<int>> rows(n_);
  for (const auto& [row, column] : entries)
    if (row != column) rows[row].push_back(column);
  row_start_.assign(1, 0);
  for (int i = 0; i < n_; ++i) {
    std::sort(rows[i].begin(), rows[i].end());
    rows[i].erase(std::unique(rows[i].begin(), rows[i].end()), rows[i].end());
    row_column_.insert(row_column_.end(), rows[i].begin(), rows[i].end());
    row_column_.push_back(i);
    row_start_.push_back(static_cast<int>(row_column_.size()));
  }
  // Elimination tree; a row's pattern is what its entries reach in the tree, and ascending order is an elimination order.
  std::vector<int> parent(n_, -1), flag(n_, -1), count(n_, 0);
  pattern_start_.assign(1, 0);
  for (int i = 0; i < n_; ++i) {
    flag[i] = i;
    const std::size_t begin = pattern_.size();
    for (const int column : rows[i])
      for (int j = column; flag[j] != i; j = parent[j]) {
        if (parent[j] < 0) parent[j] = i;
        flag[j] = i;
        pattern_.push_back(j);
        ++count[j];
      }
    std::sort(pattern_.begin() + static_cast<std::ptrdiff_t>(begin), pattern_.end());
    pattern_start_.push_back(static_cast<int>(pattern_.size()));
  }
  column_start_.assign(1, 0);
  for (int j = 0; j < n_; ++j) column_start_.push_back(column_start_.back() + count[j]);
}

std::size_t FactorStructure::values() const {
  const std::size_t band = stored_band();
  return banded_ ? (n_ + band) * (band + 1) + band_padding : row_start_.back();
}

std::size_t FactorStructure::position(int row, int column) const {
  if (banded_) {
    const std::size_t band = stored_band();
    return (band + column) * (band + 1) + row - column;
  }
  const auto begin = row_column_.begin() + row_start_[row], end = row_column_.begin() + row_start_[row + 1];
  const auto found = std::lower_bound(begin, end, column);
  if (found == end || *found != column) throw std::logic_error("entry outside the matrix pattern");
  return static_cast<std::size_t>(found - row_column_.begin());
}

}  // namespace sheetbend
