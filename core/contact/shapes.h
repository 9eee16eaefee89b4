// Every shape that the program knows, one line each. Shapes are numbered in this order.
#pragma once

#include <algorithm>
#include <string>
#include <tuple>
#include <type_traits>

#include "core/contact/capsule.h"
#include "core/contact/distance_field.h"
#include "core/contact/plane.h"
#include "core/contact/rounded_box.h"
#include "core/contact/rounded_cylinder.h"
#include "core/contact/sphere.h"

namespace sheetbend {

using Shapes = std::tuple<  //
    Plane,                  //
    Sphere,                 //
    Capsule,                //
    RoundedBox,             //
    RoundedCylinder,        //
    DistanceField>;

inline constexpr int shape_count = std::tuple_size_v<Shapes>;
inline constexpr int most_sizes = []<class... S>(std::tuple<S...>*) {
  return std::max({size_count<S>...});
}(static_cast<Shapes*>(nullptr));

// A shape of the list, and the grid of one that is given by numbers.
struct AnyShape {
  int number;
  const DistanceGrid* grid;
  AnyShape(int number_, const DistanceGrid* grid_ = nullptr) : number(number_), grid(grid_) {}
};

[[noreturn]] void throw_unknown_shape(int shape);

// Calls f with an object of the shape type that `shape` numbers.
template <int I = 0, class F>
void with_shape(int shape, F&& f) {
  if constexpr (I < shape_count) {
    if (shape == I) return f(std::tuple_element_t<I, Shapes>{});
    with_shape<I + 1>(shape, f);
  } else {
    throw_unknown_shape(shape);
  }
}

// The number of a shape's name; throws std::invalid_argument that lists the known ones.
int shape_of(const std::string& name);

// A shape that the compiler knows, in the place of AnyShape: where its numbers are in lanes.
template <class S>
struct OneShape {
  static constexpr const DistanceGrid* grid = nullptr;
};
template <class Shape>
inline constexpr int sizes_of = most_sizes;
template <class S>
inline constexpr int sizes_of<OneShape<S>> = size_count<S>;

// The distance from the surface and its gradient, as in gap.h.
template <class T>
void distance_from(const AnyShape& shape, const T* z, const T* size, T& distance, T* n) {
  with_shape(shape.number, [&]<class S>(S) {
    if constexpr (std::is_same_v<S, DistanceField>)
      S::evaluate(*shape.grid, z, distance, n);
    else
      S::evaluate(z, size, distance, n);
  });
}

template <class S, class T>
void distance_from(const OneShape<S>&, const T* z, const T* size, T& distance, T* n) {
  S::evaluate(z, size, distance, n);
}

// The direction of that gradient, which only a grid's spline may have of another length than one; the third axis where it is zero.
template <class Shape, class T>
Vec3<T> unit_normal(const Shape& shape, const Vec3<T>& n) {
  if (!shape.grid) return n;
  T unit[3];
  normalize(n, {T(0.0), T(0.0), T(1.0)}, unit);
  return Vec3<T>(unit);
}

// The unit normal alone.
template <class T>
Vec3<T> normal_at(const AnyShape& shape, const Vec3<T>& z, const T* size) {
  T at[3], distance, n[3];
  z.store(at);
  distance_from(shape, at, size, distance, n);
  return unit_normal(shape, Vec3<T>(n));
}

}  // namespace sheetbend
