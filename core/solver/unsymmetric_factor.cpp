#include "core/solver/unsymmetric_factor.h"

#include <algorithm>

namespace sheetbend {
UnsymmetricStructure::UnsymmetricStructure(int places, std::vector<std::pair<int, int>> pairs,
                                           const FactorStructure& symmetric) {
  for (int i = 0; i < places; ++i) pairs.emplace_back(i, i);
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  // A row of L reaches what its entries do in the elimination tree.
  std::vector<int> parent(places, -1), flag(places, -1);
  std::vector<std::vector<int>> above(places), slot_above(places);
  auto pair = pairs.begin();
  for (int i = 0; i < places; ++i) {
    std::vector<int> row;
    flag[i] = i;
    for (auto p = pair; p != pairs.end() && p->first == i; ++p)
      for (int j = p->second; flag[j] != i; j = parent[j]) {
        if (parent[j] < 0) parent[j] = i;
        flag[j] = i;
        row.push_back(j);
      }
    std::sort(row.begin(), row.end());
    for (const int j : row) above[j].push_back(i);
    lower_.insert(lower_.end(), row.begin(), row.end());
    lower_start_.push_back(static_cast<int>(lower_.size()));
    while (pair != pairs.end() && pair->first == i) ++pair;
  }
  upper_start_.push_back(0);
  for (const auto& row : above) {
    upper_.insert(upper_.end(), row.begin(), row.end());
    upper_start_.push_back(static_cast<int>(upper_.size()));
  }
  for (const auto& [i, j] : pairs) {
    Entry e{i == j ? i : -1, 0, 0, {}};
    if (i != j) e.lower = slot(lower_start_, lower_, i, j), e.upper = slot(upper_start_, upper_, j, i);
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) {
        const auto [column, row] = std::minmax({3 * i + a, 3 * j + b});
        e.from[3 * a + b] = symmetric.position(row, column);
      }
    entries_.push_back(e);
  }
}

int UnsymmetricStructure::slot(const std::vector<int>& start, const std::vector<int>& columns, int row, int column) {
  return static_cast<int>(std::lower_bound(columns.begin() + start[row], columns.begin() + start[row + 1], column) -
                          columns.begin());
}

std::size_t UnsymmetricStructure::bytes() const {
  return sizeof(int) * (lower_start_.size() + lower_.size() + upper_start_.size() + upper_.size()) +
         sizeof(Entry) * entries_.size();
}

void UnsymmetricFactor::resize(const UnsymmetricStructure& s) {
  lower_.resize(9 * s.blocks());
  upper_.resize(9 * s.blocks());
  pivots_.resize(s.size());
  place_.resize(s.size());
}

std::size_t UnsymmetricFactor::bytes(const UnsymmetricStructure& s) {
  return sizeof(double) * 9 * 2 * s.blocks() + (sizeof(PivotBlock) + sizeof(double*)) * s.size();
}

void UnsymmetricFactor::load(const UnsymmetricStructure& s, const double* values) {
  std::fill(lower_.begin(), lower_.end(), 0.0);
  std::fill(upper_.begin(), upper_.end(), 0.0);
  for (const auto& e : s.entries_)
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) {
        const double value = values[e.from[3 * a + b]];
        if (e.place >= 0) {
          pivots_[e.place].entries[3 * a + b] = value;
        } else {
          lower_[9 * e.lower + 3 * a + b] = value;
          upper_[9 * e.upper + 3 * b + a] = value;
        }
      }
}

void UnsymmetricFactor::add(const UnsymmetricStructure& s, int row, int column, double scale, const double* block) {
  double* to = row == column  ? pivots_[row].entries
               : row > column ? &lower_[9 * s.slot(s.lower_start_, s.lower_, row, column)]
                              : &upper_[9 * s.slot(s.upper_start_, s.upper_, row, column)];
  for (int k = 0; k < 9; ++k) to[k] += scale * block[k];
}

bool UnsymmetricFactor::factorize(const UnsymmetricStructure& s) {
  for (int i = 0; i < s.size(); ++i) {
    for (int k = s.lower_start_[i]; k < s.lower_start_[i + 1]; ++k) place_[s.lower_[k]] = &lower_[9 * k];
    for (int k = s.upper_start_[i]; k < s.upper_start_[i + 1]; ++k) place_[s.upper_[k]] = &upper_[9 * k];
    place_[i] = pivots_[i].entries;
    for (int k = s.lower_start_[i]; k < s.lower_start_[i + 1]; ++k) {
      const int before = s.lower_[k];
      double* L = &lower_[9 * k];
      for (int a = 0; a < 3; ++a) pivots_[before].solve_transposed(L + 3 * a);
      for (int u = s.upper_start_[before]; u < s.upper_start_[before + 1]; ++u) {
        const double* U = &upper_[9 * u];
        double* to = place_[s.upper_[u]];
        for (int a = 0; a < 3; ++a)
          for (int b = 0; b < 3; ++b)
            to[3 * a + b] -= L[3 * a] * U[b] + L[3 * a + 1] * U[3 + b] + L[3 * a + 2] * U[6 + b];
      }
    }
    if (!pivots_[i].factorize()) return false;
  }
  return true;
}

}  // namespace sheetbend
