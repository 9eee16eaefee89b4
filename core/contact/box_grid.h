// Which boxes of two lists overlap, by a uniform grid of cells: each box is sorted into the cells that it covers, and compared within them.
#pragma once

#include <utility>
#include <vector>

namespace sheetbend {

struct Box {
  double low[3], high[3];
};

// Pairs (i, j) of boxes a[i] and b[j] that overlap, each once, in no particular order; with `itself`, b is a and i < j.
std::vector<std::pair<int, int>> overlaps(const std::vector<Box>& a, const std::vector<Box>& b, bool itself);

}  // namespace sheetbend
