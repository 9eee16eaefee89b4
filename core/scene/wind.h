// The wind of a scene, and the drag of a particle in it.
#pragma once

#include "core/scalar/vec3.h"
#include "core/scene/scene.h"

namespace sheetbend {

// The air's velocity at a time, as drag and triangles meet it.
template <class T>
Vec3<T> wind_at(const Scene& scene, const Inputs<const T>& in, double t) {
  return scene.wind.times.empty() ? Vec3<T>() : at_knots(scene.wind.at(t), in.of(Quantity::wind), 1, 0);
}

// The force of drag on a node that the air meets with the velocity u.
template <class T>
Vec3<T> drag_force(const Inputs<const T>& in, int node, const Vec3<T>& u) {
  const T speed = sqrt_or_zero(dot(u, u));
  return (in.of(Quantity::drag_linear)[node] + in.of(Quantity::drag_quadratic)[node] * speed) * u;
}

}  // namespace sheetbend
