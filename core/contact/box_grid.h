// Which boxes overlap, by a uniform grid of cells.
#pragma once

#include <utility>
#include <vector>

namespace sheetbend {

struct Box {
  double low[3], high[3];
};

// Boxes, each listed in the cells that it covers. One that covers more cells than there are boxes is compared with all, as is one that is so far from the
// origin that doubles do not tell cells apart.
class BoxGrid {
 public:
  BoxGrid() = default;
  explicit BoxGrid(const std::vector<Box>& boxes) { reset(boxes); }

  // Begins anew with these boxes, in the memory that it has.
  void reset(const std::vector<Box>& boxes);
  void move(int i, const Box& to);

  // The numbers of all that overlap a box, in ascending order; until the next call. None where the box is not finite.
  const std::vector<int>& around(const Box& box);

 private:
  friend std::vector<std::pair<int, int>> overlaps(const std::vector<Box>& a, const std::vector<Box>& b, bool itself);

  struct Entry {
    int box, next;  // in the same place of `first_`; -1 at the end
  };

  void take(const std::vector<Box>& boxes);  // none of which is listed
  double width_of_cells();
  void list(int i);
  template <class Visit>
  bool for_each_cell(const Box& box, Visit&& visit) const;  // false, without a visit, where they are too many

  std::vector<Box> boxes_;
  double cell_ = 1.0;
  std::vector<int> first_;      // by the hash of a cell
  std::vector<Entry> entries_;  // some of boxes that have moved away
  std::vector<int> wide_, found_;
  std::vector<double> widths_;
};

// Pairs (i, j) of boxes a[i] and b[j] that overlap, each once, in no particular order; with `itself`, b is a and i < j.
std::vector<std::pair<int, int>> overlaps(const std::vector<Box>& a, const std::vector<Box>& b, bool itself);

}  // namespace sheetbend
