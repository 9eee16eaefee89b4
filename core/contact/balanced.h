// Where a point ends that only a contact holds: without it at y, of inverse mass w and in the collider's frame, it goes to
//
//   z = y + w F(z)        F: the force of touch.h, in multipliers
//
// The normal and friction act at the place that they lead to, so what is pushed out lies on the surface and what sticks has not moved. On a plane that is a
// closed form. A curved shape is replaced by its tangent plane at the place found last, until the place stays.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/contact/touch.h"

namespace sheetbend {

// The inverse of a (3, 3) matrix, row by row; its products with vectors of any scalar.
struct Inverse3 {
  double m[9];

  explicit Inverse3(const double* a) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const int p = (i + 1) % 3, q = (i + 2) % 3, r = (j + 1) % 3, s = (j + 2) % 3;
        m[3 * j + i] = a[3 * p + r] * a[3 * q + s] - a[3 * p + s] * a[3 * q + r];
      }
    const double determinant = a[0] * m[0] + a[1] * m[3] + a[2] * m[6];
    for (double& e : m) e /= determinant;
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
inline Inverse3 balance_inverse(const AnyShape& shape, const Vec3<double>& z, double w,
                                const ContactNumbers<double>& c) {
  double A[9];
  touch_matrix(shape, z, c, true, A);
  for (int i = 0; i < 9; ++i) A[i] = w * A[i] + (i % 4 == 0 ? 1.0 : 0.0);
  return Inverse3(A);
}

// What is left of z = y + w F(z).
template <class S>
Vec3<S> unbalance(const AnyShape& shape, const Vec3<S>& z, const Vec3<S>& y, const S& w, const ContactNumbers<S>& c) {
  return z - y - w * touch(shape, z, c).force;
}

inline double largest_of(const Vec3<double>& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

// The solution for values. `found` says whether the tangent planes lead to one, to rounding.
struct Balanced {
  Vec3<double> z;
  bool pushes, found;
};

// The solution where the distance is linear: `distance` at the place `at`, with the gradient n.
inline Balanced balanced_on_plane(const AnyShape& shape, const Vec3<double>& at, double distance, const Vec3<double>& n,
                                  const Vec3<double>& y, double w, const ContactNumbers<double>& c) {
  const Vec3<double> normal = unit_normal(shape, n);
  const double gap = distance - c.radius - c.lift + dot(n, y - at), steep = shape.grid ? norm(n) : 1.0;
  // q = w times the push along n: q = -stiff (gap + steep^2 q) (share - loss q)
  const double stiff = c.firm * c.kappa * w, loss = c.dissipates ? c.loss * steep : 0.0;
  const double share = c.dissipates ? 1.0 - c.loss * dot(normal, y - c.from) : 1.0;
  if (!(gap < 0.0) || !(share > 0.0)) return {y, false, true};
  const double linear = 1.0 + stiff * (steep * steep * share - loss * gap), constant = -stiff * gap * share;
  const double q =
      2.0 * constant / (linear + std::sqrt(linear * linear - 4.0 * stiff * steep * steep * loss * constant));
  const Vec3<double> trial = w * (c.carried - c.kappa * (y - c.from));
  const Vec3<double> slip = trial - dot(normal, trial) * normal;
  const double limit = steep * c.friction * q, stuck = 1.0 / (1.0 + c.kappa * w), size = norm(slip);
  return {y + q * n + (size * stuck > limit ? limit / size : stuck) * slip, true, true};
}

inline Balanced balanced(const AnyShape& shape, const Vec3<double>& y, double w, const ContactNumbers<double>& c) {
  constexpr int most_planes = 200;
  constexpr double rounding = 4.0 * std::numeric_limits<double>::epsilon();
  Balanced b{y, false, true};
  Vec3<double> last;
  for (int plane = 0; plane < most_planes; ++plane) {
    double at[3], distance, gradient[3];
    b.z.store(at);
    distance_from(shape, at, c.size, distance, gradient);
    const Vec3<double> n(gradient);
    if (plane > 0 && largest_of(n - last) == 0.0) return b;  // the surface is flat here
    const Balanced next = balanced_on_plane(shape, b.z, distance, n, y, w, c);
    const double moved = largest_of(next.z - b.z);
    b = next, last = n;
    if (!(moved > rounding * (largest_of(y) + largest_of(b.z - y)))) return b;  // of NaN too, which the rollout finds
  }
  b.found = false;
  return b;
}

// The solution over a larger scalar, given its values: what it carries beside them follows from the implicit function theorem. The first pass has as many
// digits as the inverse, the second one all.
template <class S>
Vec3<S> balanced_near(const AnyShape& shape, const Vec3<double>& z, const Vec3<S>& y, const S& w,
                      const ContactNumbers<S>& c) {
  const Inverse3 inverse = balance_inverse(shape, z, value_of(w), values_of(c));
  Vec3<S> at(S(z.x), S(z.y), S(z.z));
  for (int pass = 0; pass < 2; ++pass) at = at - inverse.times(unbalance(shape, at, y, w, c));
  return at;
}

}  // namespace sheetbend
