// Where a point ends that only a contact holds: without it at y, of inverse mass w and in the collider's frame, it goes to
//
//   z = y + w F(z)        F: the force of touch.h, in multipliers
//
// The normal and friction act at the place that they lead to, so what is pushed out lies on the surface and what sticks has not moved. On a plane that is a
// closed form. A curved shape is replaced by its tangent plane at the place found last, until the place stays.
#pragma once

#include <limits>

#include "core/contact/touch.h"

namespace sheetbend {

// The inverse of a (3, 3) matrix, row by row; its products with vectors of V or of a larger scalar.
template <class V>
struct Inverse3 {
  V m[9];

  explicit Inverse3(const V* a) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const int p = (i + 1) % 3, q = (i + 2) % 3, r = (j + 1) % 3, s = (j + 2) % 3;
        m[3 * j + i] = a[3 * p + r] * a[3 * q + s] - a[3 * p + s] * a[3 * q + r];
      }
    const V determinant = a[0] * m[0] + a[1] * m[3] + a[2] * m[6];
    for (V& e : m) e = e / determinant;
  }
  template <class S>
  Vec3<S> times(const Vec3<S>& v) const {
    return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
            m[6] * v.x + m[7] * v.y + m[8] * v.z};
  }
  template <class S>
  Vec3<S> transposed_times(const Vec3<S>& v) const {
    return {m[0] * v.x + m[3] * v.y + m[6] * v.z, m[1] * v.x + m[4] * v.y + m[7] * v.z,
            m[2] * v.x + m[5] * v.y + m[8] * v.z};
  }
};

// (I - w dF/dz)^-1 at z, with the curvature of the shape.
template <class Shape, class V>
Inverse3<V> balance_inverse(const Shape& shape, const Vec3<V>& z, const V& w, const ContactNumbers<V>& c) {
  V A[9];
  curved_touch_matrix(shape, z, c, A);
  for (int i = 0; i < 9; ++i) A[i] = w * A[i] + V(i % 4 == 0 ? 1.0 : 0.0);
  return Inverse3<V>(A);
}

// What is left of z = y + w F(z).
template <class S>
Vec3<S> unbalance(const AnyShape& shape, const Vec3<S>& z, const Vec3<S>& y, const S& w, const ContactNumbers<S>& c) {
  return z - y - w * touch(shape, z, c).force;
}

template <class V>
V largest_of(const Vec3<V>& v) {
  const V x = magnitude(v.x), y = magnitude(v.y), z = magnitude(v.z), xy = select(x < y, y, x);
  return select(xy < z, z, xy);
}

// The solution for values, in V: double or lanes. `found` says whether the tangent planes lead to one, to rounding.
template <class V>
struct Balanced {
  Vec3<V> z;
  MaskOf<V> pushes, found;
};

// The solution where the distance is linear: `distance` at the place `at`, with the gradient n.
template <class Shape, class V>
Balanced<V> balanced_on_plane(const Shape& shape, const Vec3<V>& at, const V& distance, const Vec3<V>& n,
                              const Vec3<V>& y, const V& w, const ContactNumbers<V>& c) {
  const V zero(0.0), one(1.0);
  const Vec3<V> normal = unit_normal(shape, n);
  const V gap = distance - c.radius - c.lift + dot(n, y - at), steep = shape.grid ? norm(n) : one;
  // q = w times the push along n: q = -stiff (gap + steep^2 q) (share - loss q)
  const V stiff = V(c.firm) * c.kappa * w, loss = c.dissipates ? c.loss * steep : zero;
  const V share = c.dissipates ? one - c.loss * dot(normal, y - c.from) : one;
  const MaskOf<V> pushes = (gap < zero) & (share > zero);
  const MaskOf<V> found = zero < one;
  if (!any(pushes)) return {y, pushes, found};
  const V linear = one + stiff * (steep * steep * share - loss * gap), constant = -stiff * gap * share;
  const V root = sqrt(linear * linear - V(4.0) * stiff * steep * steep * loss * constant);
  const V q = V(2.0) * constant / (linear + root);
  const Vec3<V> trial = w * (c.carried - c.kappa * (y - c.from));
  const Vec3<V> slip = trial - dot(normal, trial) * normal;
  const V limit = steep * c.friction * q, stuck = one / (one + c.kappa * w), size = norm(slip);
  const V kept = select(size * stuck > limit, limit / size, stuck);
  return {select(pushes, y + q * n + kept * slip, y), pushes, found};
}

template <class Shape, class V>
Balanced<V> balanced(const Shape& shape, const Vec3<V>& y, const V& w, const ContactNumbers<V>& c) {
  constexpr int most_planes = 200;
  const V rounding(4.0 * std::numeric_limits<double>::epsilon());
  const MaskOf<V> all = V(0.0) < V(1.0);
  Balanced<V> b{y, !all, all};
  MaskOf<V> open = all;
  Vec3<V> last;
  for (int plane = 0; plane < most_planes; ++plane) {
    V at[3], distance, gradient[3];
    b.z.store(at);
    distance_from(shape, at, c.size, distance, gradient);
    const Vec3<V> n(gradient);
    if (plane > 0) {
      open = open & (largest_of(n - last) > V(0.0));  // otherwise the surface is flat here
      if (!any(open)) return b;
    }
    const Balanced<V> next = balanced_on_plane(shape, b.z, distance, n, y, w, c);
    const V moved = largest_of(next.z - b.z);
    b.z = select(open, next.z, b.z);
    b.pushes = (open & next.pushes) | (b.pushes & !open);
    last = n;
    // What is not a number stays where it is: the rollout finds it.
    open = open & (moved > rounding * (largest_of(y) + largest_of(b.z - y)));
    if (!any(open)) return b;
  }
  b.found = !open;
  return b;
}

// The solution over a larger scalar, given its values: what it carries beside them follows from the implicit function theorem. The first pass has as many
// digits as the inverse, the second one all.
template <class S>
Vec3<S> balanced_near(const AnyShape& shape, const Vec3<double>& z, const Vec3<S>& y, const S& w,
                      const ContactNumbers<S>& c) {
  const Inverse3<double> inverse = balance_inverse(shape, z, value_of(w), values_of(c));
  Vec3<S> at(S(z.x), S(z.y), S(z.z));
  for (int pass = 0; pass < 2; ++pass) at = at - inverse.times(unbalance(shape, at, y, w, c));
  return at;
}

}  // namespace sheetbend
