// The reverse of observation.h.
#pragma once

#include "adjoint/observe/observation.h"
#include "core/scalar/dual.h"

namespace sheetbend {

inline void pull_back_sum(const Observations& o, std::size_t at, const Marker& marker, const double* x, double* x_bar) {
  using D = Dual<double, 3>;
  const double none[3]{};
  double place[3];
  marker_position(marker, x, none).store(place);
  D own[3], r[3];
  for (int i = 0; i < 3; ++i) own[i].v = place[i], own[i].d[i] = 1.0;
  marker_residuals(o, at, Vec3<D>(own), r);
  for (int k = 0; k < marker.nodes; ++k)
    for (int i = 0; i < 3; ++i)
      for (const D& one : r) x_bar[marker.dof[k] + i] += marker.weight[k] * (one.v * one.d[i]);
}

// x_bar (dofs) += the gradient of half the sum of squared residuals of one frame. A marker's position depends on the 12 numbers of
// its nodes; of more than four it is their weighted sum.
inline void pull_back_frame(const Observations& o, std::size_t frame, const double* x, const double* offsets,
                            double* x_bar) {
  using D = Dual<double, 12>;
  for (std::size_t m = 0; m < o.markers.size(); ++m) {
    const std::size_t at = frame * o.markers.size() + m;
    if (!is_seen(o, at)) continue;
    const Marker& marker = o.markers[m];
    if (marker.nodes > 4) {
      pull_back_sum(o, at, marker, x, x_bar);
      continue;
    }
    Marker on_own_nodes = marker;
    on_own_nodes.dof = {0, 3, 6, 9};
    D own[12], r[3];
    for (int i = 0; i < 12; ++i) {
      own[i].v = x[marker.dof[i / 3] + i % 3];
      own[i].d[i] = 1.0;
    }
    const D offset[3] = {offsets[3 * m], offsets[3 * m + 1], offsets[3 * m + 2]};
    marker_residuals(o, at, marker_position(on_own_nodes, own, offset), r);
    for (int i = 0; i < 12; ++i)
      for (const D& one : r) x_bar[marker.dof[i / 3] + i % 3] += one.v * one.d[i];
  }
}

}  // namespace sheetbend
