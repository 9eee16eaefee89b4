// What an unordered cloud of points is compared with.
//
// Each shape has the residuals of one point (`rows`), and functions for the part of it that is closest to a point: closest_parts finds these by values,
// corners_of gives a part's vertices, closest_place the place on it, and distances its residuals before they are divided by sigma.
#pragma once

#include <variant>

#include "adjoint/observe/cloud_of_cloth.h"
#include "adjoint/observe/cloud_of_ropes.h"

namespace sheetbend {

using CloudShape = std::variant<std::monostate, ClothSurface, RopeLines>;  // the first where there is no cloud

}  // namespace sheetbend
