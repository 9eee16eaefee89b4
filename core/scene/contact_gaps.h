// How far the points of contacts are from what they may touch.
#pragma once

#include "core/scene/scene.h"

namespace sheetbend {

// Per point of a contact at the coordinates x (dofs) and time t: the gap between it and the collider, negative inside, and its unit normal (4 numbers).
std::vector<std::array<double, 4>> contact_gaps(const Scene& scene, const Inputs<const double>& in, const double* x,
                                                double t, int contact);

}  // namespace sheetbend
