// Grids of distances.
#pragma once

#include <cmath>
#include <memory>

#include "core/contact/distance_field.h"

namespace sheetbend::testing {

// Coefficients that follow the distance from a ball around the origin, of a grid with this spacing.
inline std::shared_ptr<const DistanceGrid> ball_on_grid(double radius, double spacing) {
  const int count = 2 * static_cast<int>(std::ceil(1.5 * radius / spacing)) + 1;
  const double first = -0.5 * (count - 1) * spacing;
  DistanceGrid grid{{first + spacing, first + spacing, first + spacing}, spacing, {count, count, count}, {}};
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j)
      for (int k = 0; k < count; ++k)
        grid.coefficients.push_back(norm(Vec3<double>(first + i * spacing, first + j * spacing, first + k * spacing)) -
                                    radius);
  return std::make_shared<const DistanceGrid>(std::move(grid));
}

}  // namespace sheetbend::testing
