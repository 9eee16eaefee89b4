// The projections of a color along up to eight directions: derivatives of what project_packs.h computes next from the same numbers, one
// constraint at a time with the directions in lanes.
#pragma once

#include "core/packs/project_packs.h"
#include "core/packs/tangent.h"

namespace sheetbend {

template <class K>
void project_tangent(const sheetbend_packs::Tangents& t, int i, int lane) {
  const sheetbend_packs::Forward& f = t.values_of;
  const bool damped = f.C_r != nullptr;
  const auto place = [i](int parts, int part) { return lane_at(i, parts, part); };
  const int* nodes = f.nodes + place(K::arity, 0);
  const auto coordinate = [nodes](int d) { return static_cast<long>(nodes[d / 3 * Pack::lanes]) + d % 3; };

  Element<K, Tangent> e;
  Tangent lambda[K::rows], C_r[K::rows];
  for (int d = 0; d < K::dofs; ++d) e.x[d] = tangent_at(f.rows, t.rows, coordinate(d), lane);
  load_values<K>([&](int part) { return tangent_at(f.values, t.values, place(value_count<K>(damped), part), lane); },
                 damped, e);
  for (int j = 0; j < K::rows; ++j) {
    const long at = place(K::rows, j);
    if (!f.fresh) lambda[j] = tangent_at(f.lambda, t.lambda, at, lane);
    if (damped) C_r[j] = tangent_at(f.C_r, t.C_r, at, lane);
  }
  const Linearization<K, Tangent> value(e.x, e.p);
  const Correction<K, Tangent> correction(e, value, lambda, damped ? C_r : nullptr);
  for (int j = 0; j < K::rows; ++j)
    directions_at(t.lambda, place(K::rows, j), lane) = (lambda[j] + correction.dl[j]).d[0];
  for (int d = 0; d < K::dofs; ++d)
    directions_at(t.rows, coordinate(d), lane) += (e.w[d / 3] * correction.push[d]).d[0];
}

template <class K>
void project_tangents(const sheetbend_packs::Tangents& t, int begin, int end) {
  const int last = std::min(end * Pack::lanes, t.values_of.count);
  for (int i = begin * Pack::lanes; i < last; ++i)
    for (int lane = 0; lane < t.directions; lane += register_lanes) project_tangent<K>(t, i, lane);
}

}  // namespace sheetbend
