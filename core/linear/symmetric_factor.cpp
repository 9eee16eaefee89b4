#include "core/linear/symmetric_factor.h"

#include <algorithm>
#include <stdexcept>

namespace sheetbend {
namespace {

// Wider ones are split: updates between panels are faster than elimination inside one. Of whole particles where blocks of 3 x 3 are (unsymmetric_factor.h).
constexpr int widest_supernode = 30;

}  // namespace

FactorStructure::FactorStructure(int n, const std::vector<std::pair<int, int>>& entries, bool may_be_banded,
                                 double least_pivot)
    : n_(n), least_pivot_(least_pivot) {
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
  // A row of L reaches what its entries do in the elimination tree.
  std::vector<int> parent(n_, -1), flag(n_, -1), count(n_, 0);
  const auto for_each_in_row = [&](int i, auto&& f) {
    flag[i] = i;
    for (const int column : rows[i])
      for (int j = column; flag[j] != i; j = parent[j]) {
        if (parent[j] < 0) parent[j] = i;
        flag[j] = i;
        f(j);
      }
  };
  for (int i = 0; i < n_; ++i) for_each_in_row(i, [&](int j) { ++count[j]; });
  for (const int c : count) fill_ += c;
  join_columns(parent, count);

  const int nodes = static_cast<int>(first_.size()) - 1;
  for (int s = 0; s < nodes; ++s) row_start_.push_back(row_start_.back() + count[first_[s + 1] - 1]);
  rows_.resize(row_start_.back());
  std::vector<int> next(row_start_.begin(), row_start_.end() - 1);
  std::fill(flag.begin(), flag.end(), -1);
  for (int i = 0; i < n_; ++i)
    for_each_in_row(i, [&](int j) {
      if (j + 1 == first_[node_[j] + 1]) rows_[next[node_[j]]++] = i;
    });
  constexpr int lanes = sheetbend_blocks::lanes,
                beyond = 3 * lanes;  // what a multiplication by groups of rows may touch
  for (int s = 0; s < nodes; ++s) {
    const int width = first_[s + 1] - first_[s], used = width + row_start_[s + 1] - row_start_[s];
    length_.push_back((used + lanes - 1) / lanes * lanes);
    panel_.push_back(panel_.back() + static_cast<long>(width) * length_.back());
    widest_ = std::max(widest_, width);
    longest_ = std::max(longest_, length_.back() + beyond);
  }
  find_updates();
}

// Columns that follow one another in the tree are one supernode where their rows are the same, or where that costs few zeros.
void FactorStructure::join_columns(const std::vector<int>& parent, const std::vector<int>& count) {
  const auto panel = [&](int begin, int end) {
    const std::size_t width = end - begin;
    return width * (width + 1) / 2 + width * count[end - 1];
  };
  struct Node {
    int first;
    std::size_t entries;
  };
  std::vector<Node> nodes;
  for (int j = 0; j < n_; ++j) {
    nodes.push_back({j, static_cast<std::size_t>(count[j]) + 1});
    while (nodes.size() > 1 && parent[nodes.back().first - 1] == nodes.back().first) {
      const Node& before = nodes[nodes.size() - 2];
      const std::size_t entries = before.entries + nodes.back().entries;
      if (j + 1 - before.first > widest_supernode || 4 * panel(before.first, j + 1) > 5 * entries + 32) break;
      nodes.pop_back();
      nodes.back().entries = entries;
    }
  }
  first_.clear();
  for (const Node& node : nodes) first_.push_back(node.first);
  first_.push_back(n_);
  node_.resize(n_);
  for (std::size_t s = 0; s + 1 < first_.size(); ++s)
    for (int j = first_[s]; j < first_[s + 1]; ++j) node_[j] = static_cast<int>(s);
}

// A supernode's rows that are columns of the same later one are one update of that.
void FactorStructure::find_updates() {
  const int nodes = static_cast<int>(first_.size()) - 1;
  std::vector<std::vector<sheetbend_blocks::Update>> of(nodes);
  for (int s = 0; s < nodes; ++s) {
    const int *rows = rows_.data() + row_start_[s], count = row_start_[s + 1] - row_start_[s];
    for (int begin = 0, end; begin < count; begin = end) {
      for (end = begin + 1; end < count && node_[rows[end]] == node_[rows[begin]];) ++end;
      of[node_[rows[begin]]].push_back({s, begin, end});
    }
  }
  for (const auto& updates : of) {
    updates_.insert(updates_.end(), updates.begin(), updates.end());
    update_start_.push_back(static_cast<int>(updates_.size()));
  }
}

sheetbend_blocks::Supernodes FactorStructure::supernodes() const {
  return {static_cast<int>(first_.size()) - 1,
          widest_,
          longest_,
          first_.data(),
          row_start_.data(),
          rows_.data(),
          length_.data(),
          panel_.data(),
          update_start_.data(),
          updates_.data(),
          least_pivot_};
}

std::size_t FactorStructure::values() const {
  const std::size_t band = stored_band();
  return banded_ ? (n_ + band) * (band + 1) + band_padding : panel_.back() + longest_;
}

std::size_t FactorStructure::bytes() const {
  return sizeof(int) *
             (first_.size() + row_start_.size() + rows_.size() + length_.size() + update_start_.size() + node_.size()) +
         sizeof(long) * panel_.size() + sizeof(sheetbend_blocks::Update) * updates_.size();
}

std::size_t FactorStructure::position(int row, int column) const {
  if (banded_) {
    const std::size_t band = stored_band();
    return (band + column) * (band + 1) + row - column;
  }
  const int node = node_[column], width = first_[node + 1] - first_[node];
  const std::size_t begin = panel_[node] + static_cast<std::size_t>(column - first_[node]) * length_[node];
  if (row < first_[node + 1]) return begin + row - first_[node];
  const auto rows = rows_.begin() + row_start_[node], end = rows_.begin() + row_start_[node + 1];
  const auto found = std::lower_bound(rows, end, row);
  if (found == end || *found != row) throw std::logic_error("entry outside the matrix pattern");
  return begin + width + static_cast<std::size_t>(found - rows);
}

template class Factor<double>;
template void Factor<double>::solve(const FactorStructure&, double*) const;

}  // namespace sheetbend
