// LDL^T of the matrix of a direct block, over any scalar and without pivoting. The structure is found once; banded for chains
// (O(n) with a small constant), by supernodes for the rest (core/blocks/supernodes.h, after an ordering that keeps fill low).
#pragma once

#include <type_traits>
#include <utility>
#include <vector>

#include "core/blocks/supernodes.h"

namespace sheetbend {

// The pattern: which entries of the lower triangle exist and where their values stand.
class FactorStructure {
 public:
  // entries: (row, column) pairs of the lower triangle in elimination order, duplicates allowed; the diagonal is always there. least_pivot: as in
  // sheetbend_blocks::Supernodes; that of a band, which only constraints' matrices have, is redundant_pivot.
  FactorStructure(int n, const std::vector<std::pair<int, int>>& entries, bool may_be_banded = true,
                  double least_pivot = 0.0);

  int size() const { return n_; }
  bool banded() const { return banded_; }
  int half_bandwidth() const { return band_; }
  int stored_band() const { return sheetbend::stored_band(band_); }
  std::size_t values() const;
  std::size_t position(int row, int column) const;  // row >= column
  // Of factors by supernodes: whether two columns are of the same one, and how far apart its columns stand.
  bool joins(int column, int other) const { return node_[column] == node_[other]; }
  std::size_t column_length(int column) const { return length_[node_[column]]; }
  std::size_t fill() const { return banded_ ? static_cast<std::size_t>(n_) * (band_ + 1) : fill_; }
  std::size_t bytes() const;  // of the pattern itself

  sheetbend_blocks::Supernodes supernodes() const;
  std::size_t work() const { return banded_ ? 0 : 4 * static_cast<std::size_t>(widest_ + longest_); }
  std::size_t longest() const { return longest_; }

 private:
  void build_sparse(const std::vector<std::pair<int, int>>& entries);
  void join_columns(const std::vector<int>& parent, const std::vector<int>& count);
  void find_updates();

  int n_ = 0, band_ = 0;
  bool banded_ = true;
  double least_pivot_ = 0.0;
  std::size_t fill_ = 0;  // entries of L below its diagonal
  // As in sheetbend_blocks::Supernodes; node_ of every column.
  int widest_ = 0, longest_ = 0;
  std::vector<int> first_{0}, row_start_{0}, rows_, length_, update_start_{0}, node_;
  std::vector<long> panel_{0};
  std::vector<sheetbend_blocks::Update> updates_;
};

template <class T>
class Factor {
 public:
  std::vector<T> values;   // A on entry, by FactorStructure::position
  std::vector<T> inverse;  // of the pivots, after as many zeros as the stored band is wide

  // A right side of a band is as long as the matrix and the stored band, with zeros at the end.
  static std::size_t right_side(const FactorStructure& s) { return s.banded() ? s.size() + s.stored_band() : s.size(); }

  static std::size_t bytes(const FactorStructure& s) {
    const std::size_t own = sizeof(T) * (s.values() + right_side(s));
    return s.banded() ? own : own + sizeof(T) * s.work() + sizeof(int) * s.size();
  }

  void reset(const FactorStructure& s) {
    values.assign(s.values(), T(0.0));
    inverse.assign(right_side(s), T(0.0));
    if (s.banded()) return;
    work_.resize(s.work());
    place_.resize(s.size());
  }

  // `compiled` for this machine's instruction set where it is given, otherwise here.
  using FactorSupernodes = decltype(sheetbend_blocks::Forward::factor_supernodes);
  void factorize(const FactorStructure& s, FactorSupernodes compiled = nullptr) {
    if (s.banded())
      return with_band(s.stored_band(), [&]<int Band>() {
        factorize_band<Band>(s.size(), s.stored_band(), values.data(), inverse.data());
      });
    const auto supernodes = s.supernodes();
    if (compiled)
      compiled(supernodes, reinterpret_cast<double*>(values.data()), reinterpret_cast<double*>(inverse.data()),
               reinterpret_cast<double*>(work_.data()), place_.data());
    else
      SupernodalFactor<T>{supernodes, values.data(), inverse.data(), work_.data(), place_.data()}.factorize();
  }

  template <class U>
  void solve(const FactorStructure& s, U* b) const {
    if (s.banded())
      return with_band(s.stored_band(), [&]<int Band>() {
        solve_band<Band>(s.size(), s.stored_band(), values.data(), inverse.data(), b);
      });
    U* gathered;
    if constexpr (std::is_same_v<T, U>) {
      gathered = work_.data();
    } else {
      thread_local std::vector<U> own;
      if (own.size() < s.longest()) own.resize(s.longest());
      gathered = own.data();
    }
    solve_supernodes(s.supernodes(), values.data(), inverse.data(), b, gathered);
  }

 private:
  mutable std::vector<T> work_;
  std::vector<int> place_;
};

extern template class Factor<double>;
extern template void Factor<double>::solve(const FactorStructure&, double*) const;

}  // namespace sheetbend
