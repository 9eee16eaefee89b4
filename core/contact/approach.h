// How near two come while their nodes go straight, all in the same time: by conservative advancement, as in Li et al. (2021), Codimensional Incremental
// Potential Contact, sec. 4.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/contact/meeting.h"

namespace sheetbend {

// Whether they come as near as `least` on the way from x by d (12), counted from distances of these numbers. True too where they come within `slack` of that
// and time would be lost to tell.
inline bool comes_nearer(bool triangle, const double* x, const double* d, double least, double slack,
                         const PairNumbers<double>& n) {
  constexpr int most_advances = 64;
  double mean[3] = {0.0, 0.0, 0.0}, moved[12], speed[4], at[12], ends[2][12];
  for (int i = 0; i < 12; ++i) mean[i % 3] += 0.25 * d[i];
  for (int i = 0; i < 12; ++i) {
    moved[i] = d[i] - mean[i % 3];
    ends[0][i] = x[i], ends[1][i] = x[i] + moved[i];
  }
  if (boxes_are_apart(triangle, ends, 2, least)) return false;
  for (int k = 0; k < 4; ++k) speed[k] = std::hypot(moved[3 * k], moved[3 * k + 1], moved[3 * k + 2]);
  const double approach = triangle ? speed[0] + std::max({speed[1], speed[2], speed[3]})
                                   : std::max(speed[0], speed[1]) + std::max(speed[2], speed[3]);
  double t = 0.0;
  for (int advance = 0; advance < most_advances; ++advance) {
    for (int i = 0; i < 12; ++i) at[i] = x[i] + t * moved[i];
    const double room = distance_of(triangle, at, n) - least;
    if (!(room > slack)) return true;
    if (room >= (1.0 - t) * approach) return false;
    t += room / approach;
  }
  return true;
}

}  // namespace sheetbend
