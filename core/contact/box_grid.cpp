#include "core/contact/box_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace sheetbend {
namespace {

constexpr double most_per_box = 16.0;           // cells on average
constexpr double most_cells = 1024.0 * 1024.0;  // along an axis, whose number takes 21 bits

using Cell = std::array<std::int64_t, 3>;

struct Grid {
  double origin[3], size;

  Cell of(const double* p) const {
    Cell c;
    for (int d = 0; d < 3; ++d) c[d] = static_cast<std::int64_t>(std::floor((p[d] - origin[d]) / size));
    return c;
  }
  static std::uint64_t key(const Cell& c) {
    return static_cast<std::uint64_t>(c[0]) << 42 | static_cast<std::uint64_t>(c[1]) << 21 |
           static_cast<std::uint64_t>(c[2]);
  }
};

// Cells as wide as boxes are on average; wider where some boxes would cover too many.
Grid grid_around(const std::vector<const Box*>& boxes) {
  Grid g{{0.0, 0.0, 0.0}, 0.0};
  double extent = 0.0;
  for (int d = 0; d < 3; ++d) {
    double low = boxes.front()->low[d], high = boxes.front()->high[d];
    for (const Box* b : boxes) low = std::min(low, b->low[d]), high = std::max(high, b->high[d]);
    g.origin[d] = low;
    extent = std::max(extent, high - low);
  }
  for (const Box* b : boxes) {
    double widest = 0.0;
    for (int d = 0; d < 3; ++d) widest = std::max(widest, b->high[d] - b->low[d]);
    g.size += widest / static_cast<double>(boxes.size());
  }
  g.size = std::max({g.size, extent / most_cells, 1e-300});
  const auto covered = [&] {
    double sum = 0.0;
    for (const Box* b : boxes) {
      double cells = 1.0;
      for (int d = 0; d < 3; ++d) cells *= std::floor((b->high[d] - b->low[d]) / g.size) + 2.0;
      sum += cells;
    }
    return sum;
  };
  while (covered() > most_per_box * static_cast<double>(boxes.size())) g.size *= 2.0;
  return g;
}

bool overlap(const Box& a, const Box& b) {
  for (int d = 0; d < 3; ++d)
    if (a.high[d] < b.low[d] || b.high[d] < a.low[d]) return false;
  return true;
}

}  // namespace

std::vector<std::pair<int, int>> overlaps(const std::vector<Box>& a, const std::vector<Box>& b, bool itself) {
  std::vector<std::pair<int, int>> found;
  std::vector<const Box*> boxes;
  for (const Box& box : a) boxes.push_back(&box);
  const auto first_of_b = static_cast<int>(boxes.size());
  if (!itself)
    for (const Box& box : b) boxes.push_back(&box);
  if (a.empty() || (!itself && b.empty())) return found;
  const Grid grid = grid_around(boxes);
  std::vector<Cell> low(boxes.size());
  std::vector<std::pair<std::uint64_t, int>> entries;
  for (int i = 0; i < static_cast<int>(boxes.size()); ++i) {
    const Cell from = low[i] = grid.of(boxes[i]->low), to = grid.of(boxes[i]->high);
    Cell c;
    for (c[0] = from[0]; c[0] <= to[0]; ++c[0])
      for (c[1] = from[1]; c[1] <= to[1]; ++c[1])
        for (c[2] = from[2]; c[2] <= to[2]; ++c[2]) entries.emplace_back(Grid::key(c), i);
  }
  std::sort(entries.begin(), entries.end());
  const auto compare = [&](std::uint64_t key, int i, int j) {
    Cell common;  // the first cell that both cover: the only one in which they are looked at
    for (int d = 0; d < 3; ++d) common[d] = std::max(low[i][d], low[j][d]);
    if (Grid::key(common) == key && overlap(*boxes[i], *boxes[j])) found.emplace_back(i, itself ? j : j - first_of_b);
  };
  for (std::size_t begin = 0, end; begin < entries.size(); begin = end) {
    end = begin + 1;
    while (end < entries.size() && entries[end].first == entries[begin].first) ++end;
    for (std::size_t p = begin; p < end; ++p)  // boxes of a come first
      for (std::size_t q = p + 1; q < end; ++q)
        if (itself || (entries[p].second < first_of_b && entries[q].second >= first_of_b))
          compare(entries[p].first, entries[p].second, entries[q].second);
  }
  return found;
}

}  // namespace sheetbend
