// An elimination order of low fill: approximate minimum degree (Amestoy, Davis & Duff 1996).
#pragma once

#include <vector>

namespace sheetbend {

// Places of nodes (numbered from 0) in an order of low fill, given which of them the constraints join.
std::vector<int> places_for_low_fill(int nodes, const std::vector<std::vector<int>>& joined);

}  // namespace sheetbend
