#include "core/scene/pair_gaps.h"

#include "core/contact/find_pairs.h"
#include "core/contact/meeting.h"
#include "core/contact/spots.h"

namespace sheetbend {

std::vector<PairGap> pair_gaps(const Scene& scene, const Inputs<const double>& in, const double* x) {
  const SelfContact& s = scene.self_contact;
  if (s.empty()) return {};
  std::vector<double> rows(3 * static_cast<std::size_t>(s.spots())), radius(s.spots(), 0.0), reach(s.spots(), 0.0);
  const Spots<double> spots(s, [&](std::size_t i) { return in.of(Quantity::contact_weight)[i]; });
  for (int n = 0; n < s.spots(); ++n) {
    spots.at(n, [&](int node) { return Vec3<double>(x + scene.first_dof[node]); }).store(&rows[3 * n]);
    if (s.radius[n] >= 0) radius[n] = in.of(Quantity::contact_radius)[s.radius[n]];
  }
  std::vector<PairGap> gaps;
  for (const PairKey& key : find_pairs(s, {rows.data(), 3, radius.data(), reach.data()})) {
    auto nodes = spots_of(s, key);
    double at[12];
    gather(nodes, rows.data(), 3, at);
    const double touching = radius[nodes[0]] + radius[nodes[key.triangle ? 1 : 2]];
    for (int& n : nodes) n = s.whole(n);
    gaps.push_back({distance_of(key.triangle, at, {touching, 1.0}) - touching, nodes});
  }
  return gaps;
}

}  // namespace sheetbend
