#include "adjoint/library/ranges.h"

#include <algorithm>
#include <limits>

#include "core/constraints/registry.h"

namespace sheetbend::library {
namespace {

constexpr double huge = std::numeric_limits<double>::max(), tiny = std::numeric_limits<double>::denorm_min();

}  // namespace

bool not_negative(Quantity array) {
  constexpr Quantity all[]{Quantity::mass,           Quantity::compliance,        Quantity::damping,
                           Quantity::drag_linear,    Quantity::drag_quadratic,    Quantity::air_normal,
                           Quantity::air_tangential, Quantity::volume_compliance, Quantity::contact_dissipation};
  return std::ranges::find(all, array) != std::end(all);
}

Ranges ranges_of(const Scene& scene) {
  const Layout& layout = scene.layout;
  Ranges r{std::vector<double>(layout.total(), -huge), std::vector<double>(layout.total(), huge)};
  const auto fill = [&](std::vector<double>& ends, Quantity q, double end) {
    std::fill_n(ends.begin() + static_cast<std::ptrdiff_t>(layout.of(q)), layout.count(q), end);
  };
  for (int q = 0; q < quantity_count; ++q)
    if (not_negative(static_cast<Quantity>(q))) fill(r.least, static_cast<Quantity>(q), 0.0);
  fill(r.least, Quantity::volume, tiny);
  for (int n = 0; n < scene.nodes(); ++n)
    if (scene.role[n] == Role::free) r.least[layout.of(Quantity::mass) + n] = tiny;
  if (!scene.has_drag)
    for (const Quantity q : {Quantity::drag_linear, Quantity::drag_quadratic}) fill(r.most, q, 0.0);
  for (const sheetbend::Group& g : scene.groups)
    with_kind(g.kind, [&]<class K>(K) {
      for (int i = 0; i < g.count; ++i) {
        if (K::compliance.never_zero) r.least[layout.of(Quantity::compliance) + g.first + i] = tiny;
        if (!g.damped) r.most[layout.of(Quantity::damping) + g.first + i] = 0.0;
        for (int k = 0; k < g.parameters; ++k) {
          const std::size_t at =
              layout.of(Quantity::rest) + g.first_value + static_cast<std::size_t>(i) * g.parameters + k;
          r.least[at] = K::parameters[k].range.least, r.most[at] = K::parameters[k].range.most;
        }
      }
    });
  return r;
}

std::string describe_input(const Scene& scene, std::size_t input) {
  const Layout& layout = scene.layout;
  int q = 0;
  while (input >= layout.offset[q + 1]) ++q;
  const std::size_t i = input - layout.offset[q];
  const std::string array = quantity_names[q];
  switch (static_cast<Quantity>(q)) {
    case Quantity::position:
    case Quantity::velocity: return array + " of particle " + std::to_string(i / 3);
    case Quantity::mass:
    case Quantity::drag_linear:
    case Quantity::drag_quadratic: return array + " of particle " + std::to_string(i);
    case Quantity::compliance:
    case Quantity::damping:
      for (const sheetbend::Group& g : scene.groups)
        if (static_cast<int>(i) < g.first + g.count)
          return array + " of constraint " + std::to_string(static_cast<int>(i) - g.first) + " of group '" + g.name +
                 "'";
      break;
    case Quantity::rest:
      for (const sheetbend::Group& g : scene.groups)
        if (i < g.first_value + static_cast<std::size_t>(g.count) * g.parameters)
          return array + " of constraint " + std::to_string((i - g.first_value) / g.parameters) + " of group '" +
                 g.name + "'";
      break;
    default: break;
  }
  return array + " at entry " + std::to_string(i);
}

}  // namespace sheetbend::library
