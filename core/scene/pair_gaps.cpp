#include "core/scene/pair_gaps.h"

#include "core/contact/find_pairs.h"
#include "core/contact/meeting.h"

namespace sheetbend {

std::vector<PairGap> pair_gaps(const Scene& scene, const Inputs<const double>& in, const double* x) {
  const SelfContact& s = scene.self_contact;
  if (s.empty()) return {};
  std::vector<double> rows(3 * static_cast<std::size_t>(scene.nodes())), radius(scene.nodes(), 0.0),
      reach(scene.nodes(), 0.0);
  for (int n = 0; n < scene.nodes(); ++n) {
    for (int d = 0; d < 3; ++d) rows[3 * n + d] = x[scene.first_dof[n] + d];
    if (s.radius[n] >= 0) radius[n] = in.of(Quantity::contact_radius)[s.radius[n]];
  }
  std::vector<PairGap> gaps;
  for (const PairKey& key : find_pairs(s, {rows.data(), 3, radius.data(), reach.data()})) {
    const auto nodes = nodes_of(s, key);
    double at[12];
    gather(nodes, rows.data(), 3, at);
    const double touching = radius[nodes[0]] + radius[nodes[key.triangle ? 1 : 2]];
    gaps.push_back({distance_of(key.triangle, at, {touching, 1.0}) - touching, nodes});
  }
  return gaps;
}

}  // namespace sheetbend
