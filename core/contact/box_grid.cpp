#include "core/contact/box_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace sheetbend {
namespace {

constexpr double most_per_box = 16.0;  // cells on average
constexpr double too_far = 1e15;       // in cells from the origin, where their numbers are no longer exact

bool is_finite(const Box& box) {
  for (int d = 0; d < 3; ++d)
    if (!std::isfinite(box.high[d] - box.low[d])) return false;
  return true;
}

constexpr Box nowhere{{NAN, NAN, NAN}, {NAN, NAN, NAN}};

bool overlap(const Box& a, const Box& b) {  // not where one is nowhere
  for (int d = 0; d < 3; ++d)
    if (!(a.high[d] >= b.low[d] && b.high[d] >= a.low[d])) return false;
  return true;
}

}  // namespace

// As wide as the box in the middle of their order by width, which a few large ones do not move; wider where the boxes would cover too many cells. One that
// covers more cells than there are boxes counts as often as it is compared.
double BoxGrid::width_of_cells() {
  widths_.clear();
  for (const Box& b : boxes_) {
    if (!is_finite(b)) continue;
    double widest = 0.0;
    for (int d = 0; d < 3; ++d) widest = std::max(widest, b.high[d] - b.low[d]);
    widths_.push_back(widest);
  }
  if (widths_.empty()) return 1.0;
  const auto middle = widths_.begin() + static_cast<std::ptrdiff_t>(widths_.size() / 2);
  std::nth_element(widths_.begin(), middle, widths_.end());
  double size = std::max(*middle, 1e-300);
  const double count = static_cast<double>(boxes_.size());
  const auto covered = [&] {
    double sum = 0.0;
    for (const Box& b : boxes_) {
      if (!is_finite(b)) continue;
      double cells = 1.0;
      for (int d = 0; d < 3; ++d) cells *= std::floor((b.high[d] - b.low[d]) / size) + 2.0;
      sum += std::min(cells, most_per_box + count);
    }
    return sum;
  };
  while (covered() > most_per_box * count) size *= 2.0;
  return size;
}

void BoxGrid::take(const std::vector<Box>& boxes) {
  boxes_ = boxes;
  cell_ = width_of_cells();
  first_.assign(std::bit_ceil(4 * boxes_.size() + 1), -1);
  entries_.clear();
  wide_.clear();
}

void BoxGrid::reset(const std::vector<Box>& boxes) {
  take(boxes);
  for (int i = 0; i < static_cast<int>(boxes_.size()); ++i) list(i);
}

template <class Visit>
bool BoxGrid::for_each_cell(const Box& box, Visit&& visit) const {
  std::int64_t from[3], to[3];
  double cells = 1.0;
  for (int d = 0; d < 3; ++d) {
    const double low = std::floor(box.low[d] / cell_);
    const double high = std::floor(box.high[d] / cell_);
    cells *= high - low + 1.0;
    if (!(std::max(std::abs(low), std::abs(high)) < too_far &&
          cells <= most_per_box + static_cast<double>(boxes_.size())))
      return false;
    from[d] = static_cast<std::int64_t>(low), to[d] = static_cast<std::int64_t>(high);
  }
  for (std::int64_t x = from[0]; x <= to[0]; ++x)
    for (std::int64_t y = from[1]; y <= to[1]; ++y)
      for (std::int64_t z = from[2]; z <= to[2]; ++z) {
        const auto hash = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15u +
                          static_cast<std::uint64_t>(y) * 0xC2B2AE3D27D4EB4Fu +
                          static_cast<std::uint64_t>(z) * 0x165667B19E3779F9u;
        visit((hash >> 32) & (first_.size() - 1));
      }
  return true;
}

void BoxGrid::list(int i) {
  if (!is_finite(boxes_[i])) return;
  const bool listed = for_each_cell(boxes_[i], [&](std::size_t at) {
    entries_.push_back({i, first_[at]});
    first_[at] = static_cast<int>(entries_.size()) - 1;
  });
  if (!listed) wide_.push_back(i);
}

void BoxGrid::move(int i, const Box& to) {
  boxes_[i] = is_finite(to) ? to : nowhere;
  list(i);
}

const std::vector<int>& BoxGrid::around(const Box& box) {
  found_.clear();
  if (!is_finite(box)) return found_;
  const auto compare = [&](int i) {
    if (overlap(boxes_[i], box)) found_.push_back(i);
  };
  const bool narrow = for_each_cell(box, [&](std::size_t at) {
    for (int e = first_[at]; e >= 0; e = entries_[e].next) compare(entries_[e].box);
  });
  for (const int i : wide_) compare(i);
  if (!narrow)
    for (const Entry& e : entries_) compare(e.box);
  std::sort(found_.begin(), found_.end());
  found_.erase(std::unique(found_.begin(), found_.end()), found_.end());
  return found_;
}

std::vector<std::pair<int, int>> overlaps(const std::vector<Box>& a, const std::vector<Box>& b, bool itself) {
  std::vector<std::pair<int, int>> found;
  BoxGrid grid;
  if (itself)
    grid.take(a);
  else
    grid.reset(b);
  for (int i = 0; i < static_cast<int>(a.size()); ++i) {
    for (const int j : grid.around(a[i])) found.emplace_back(itself ? j : i, itself ? i : j);
    if (itself) grid.list(i);  // so each pair is looked at once
  }
  return found;
}

}  // namespace sheetbend
