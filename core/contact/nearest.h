// Where two segments, or a point and a triangle, are nearest to each other. Which part of them that is (the inside, an edge, a corner) is found by values; the
// place on that part has a closed form over any scalar, so that its derivatives are right.
//
// Parallel segments are equally near all along, and their nearest points would jump from one end to the other. So the distance of segments is the root of
//
//   min |A(s) - B(t)|^2 + softness ((s - 1/2)^2 + (t - 1/2)^2)          0 <= s, t <= 1
//
// which is smooth, and has one minimum, at the middle of what lies side by side. With softness = c D^2, D the distance at which they touch, it is by c D/4 at
// most farther than the nearest points. Its derivative is that of |A - B| with s and t held, since they are at a minimum.
#pragma once

#include <algorithm>

#include "core/scalar/vec3.h"

namespace sheetbend {

inline constexpr double segment_softness = 1e-2;  // c

// A part of a pair: of segments where s and t are, free (-1) or at an end (0, 1). Of a triangle the edge (-1: its inside), and where on it likewise.
struct Part {
  signed char first = -1, second = -1;
};

template <class T>
struct Nearest {
  T weight[4];  // of the four nodes; negative on the second side
  Vec3<T> apart;
  T squared;  // of the distance
};

template <class T>
Nearest<T> segments_at(const T* x, const T& softness, const T& s, const T& t) {
  const T one(1.0), half(0.5);
  Nearest<T> n{{one - s, s, t - one, -t}, {}, {}};
  const Vec3<T> between = Vec3<T>(x) - Vec3<T>(x + 6);
  n.apart = between + s * (Vec3<T>(x + 3) - Vec3<T>(x)) - t * (Vec3<T>(x + 9) - Vec3<T>(x + 6));
  n.squared = dot(n.apart, n.apart) + softness * ((s - half) * (s - half) + (t - half) * (t - half));
  return n;
}

template <class T>
Nearest<T> nearest_on_segments(const T* x, const T& softness, Part part) {
  const Vec3<T> u = Vec3<T>(x + 3) - Vec3<T>(x), v = Vec3<T>(x + 9) - Vec3<T>(x + 6), r = Vec3<T>(x) - Vec3<T>(x + 6);
  const T a = dot(u, u) + softness, b = dot(u, v), c = dot(v, v) + softness, half = T(0.5) * softness;
  const T along_u = half - dot(u, r), along_v = half + dot(v, r);
  T s(static_cast<double>(part.first)), t(static_cast<double>(part.second));
  if (part.first < 0 && part.second < 0) {
    const T inverse = T(1.0) / (a * c - b * b);
    s = inverse * (c * along_u + b * along_v);
    t = inverse * (b * along_u + a * along_v);
  } else if (part.first < 0) {
    s = (along_u + b * t) / a;
  } else if (part.second < 0) {
    t = (along_v + b * s) / c;
  }
  return segments_at(x, softness, s, t);
}

// Corners of a triangle's edges.
inline constexpr int triangle_edges[3][2] = {{0, 1}, {1, 2}, {2, 0}};

template <class T>
Nearest<T> nearest_on_triangle(const T* x, Part part) {
  const T zero(0.0), one(1.0);
  const Vec3<T> p(x);
  const auto corner = [&](int k) { return Vec3<T>(x + 3 * (k + 1)); };
  T share[3] = {zero, zero, zero};
  if (part.first < 0) {
    const Vec3<T> e = corner(1) - corner(0), f = corner(2) - corner(0), r = p - corner(0);
    const T a = dot(e, e), b = dot(e, f), c = dot(f, f), along_e = dot(e, r), along_f = dot(f, r);
    const T inverse = one / (a * c - b * b);
    share[1] = inverse * (c * along_e - b * along_f);
    share[2] = inverse * (a * along_f - b * along_e);
    share[0] = one - share[1] - share[2];
  } else {
    const int from = triangle_edges[part.first][0], to = triangle_edges[part.first][1];
    const Vec3<T> e = corner(to) - corner(from);
    share[to] = part.second < 0 ? dot(e, p - corner(from)) / dot(e, e) : T(static_cast<double>(part.second));
    share[from] = one - share[to];
  }
  Nearest<T> n{{one, -share[0], -share[1], -share[2]}, {}, {}};
  n.apart = share[0] * (p - corner(0)) + share[1] * (p - corner(1)) + share[2] * (p - corner(2));
  n.squared = dot(n.apart, n.apart);
  return n;
}

template <class T>
Nearest<T> nearest_points(bool triangle, const T* x, const T& softness, Part part) {
  return triangle ? nearest_on_triangle(x, part) : nearest_on_segments(x, softness, part);
}

inline Part part_of_segments(const double* x, double softness) {
  const auto side = [](double a) { return a <= 0.0 ? 0 : a >= 1.0 ? 1 : -1; };
  const auto inside = [&](double a) { return side(a) < 0; };
  const Nearest<double> open = nearest_on_segments(x, softness, {});
  if (inside(open.weight[1]) && inside(-open.weight[3])) return {};
  Part best;
  double least = 0.0;
  for (signed char which = 0; which < 4; ++which) {
    const auto end = static_cast<signed char>(which % 2);
    Part part = which < 2 ? Part{end, -1} : Part{-1, end};
    const Nearest<double> n = nearest_on_segments(x, softness, part);
    signed char& other = which < 2 ? part.second : part.first;
    other = static_cast<signed char>(side(which < 2 ? -n.weight[3] : n.weight[1]));
    const double squared = nearest_on_segments(x, softness, part).squared;
    if (which == 0 || squared < least) best = part, least = squared;
  }
  return best;
}

inline Part part_of_triangle(const double* x) {
  const Nearest<double> open = nearest_on_triangle(x, {});
  if (open.weight[1] < 0.0 && open.weight[2] < 0.0 && open.weight[3] < 0.0) return {};
  Part best;
  double least = 0.0;
  for (signed char edge = 0; edge < 3; ++edge) {
    const double along = -nearest_on_triangle(x, {edge, -1}).weight[1 + triangle_edges[edge][1]];
    const Part part{edge, static_cast<signed char>(along <= 0.0 ? 0 : along >= 1.0 ? 1 : -1)};
    const double squared = nearest_on_triangle(x, part).squared;
    if (edge == 0 || squared < least) best = part, least = squared;
  }
  return best;
}

inline Part nearest_part(bool triangle, const double* x, double softness) {
  return triangle ? part_of_triangle(x) : part_of_segments(x, softness);
}

}  // namespace sheetbend
