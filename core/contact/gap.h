// The contract of a closed shape that particles may touch. An author writes the distance from its surface and the distance's gradient once, over any
// scalar; the law of contact, its derivatives, the motion of colliders and the tests follow from that.
//
//   struct Sphere {
//     static constexpr const char* name = "sphere";
//     static constexpr const char* about = "all points ...";   in one line, for lists
//     static constexpr std::array sizes{"radius"};             its lengths [m], positive; std::array<const char*, 0>{} where it has none
//     template <class T> static void evaluate(const T* z, const T* size, T& distance, T* n);
//   };
//
// z (3) is a point in the shape's own frame [m], `distance` its distance from the surface [m], negative inside, and n (3) the gradient of the distance with
// respect to z, a unit vector. Where the distance has a kink, n is that of one side. No number may be divided by zero: a shape says in its header what it does
// where there is no direction. T may be a pack, so branches are written with select(). shapes.h lists all shapes. distance_field.h differs: it reads a grid
// in the place of sizes, its gradient is no unit vector to the last digit, and its T is never a pack.
#pragma once

#include <array>

#include "core/contact/masks.h"

namespace sheetbend {

template <class S>
inline constexpr int size_count = static_cast<int>(S::sizes.size());

// v over its length, and the length; `otherwise` where it has none.
template <class T>
T normalize(const Vec3<T>& v, const Vec3<T>& otherwise, T* n) {
  const T squared = dot(v, v);
  const auto has_length = squared > T(0.0);
  const T length = sqrt(select(has_length, squared, T(1.0)));
  select(has_length, (T(1.0) / length) * v, otherwise).store(n);
  return select(has_length, length, T(0.0));
}

}  // namespace sheetbend
