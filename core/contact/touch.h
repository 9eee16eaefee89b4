// One particle against one collider: the law of contact at a point of the collider's frame, and its derivative with respect to that point.
#pragma once

#include "core/contact/law.h"
#include "core/contact/shapes.h"
#include "core/scalar/dual.h"

namespace sheetbend {

// What the law reads besides the point, in the collider's frame and in multipliers.
template <class T>
struct ContactNumbers {
  Vec3<T> from;     // history of the point, as for Bdf: slip is counted from there
  Vec3<T> carried;  // tangential force before
  T friction, radius, kappa;
  T size[most_sizes];
  T lift{}, leaving{};  // of restitution (rebound.h): how far above the surface it pushes to, and what it carries on
  T loss{};             // of a contact that dissipates: a/eta
  bool dissipates = false;
  double firm = 1.0;  // how many times stiffer it is along the normal
};

template <class T>
struct Touch : ContactForce<T> {
  Vec3<T> force;  // on the particle
};

// At this distance, with this gradient; C as in law.h. The push is along the gradient, so that it has a potential, and Coulomb's limit is that of the
// whole push.
template <class Shape, class T, class C>
Touch<T> touch(const Shape& shape, const T& distance, const Vec3<C>& n, const Vec3<T>& z, const ContactNumbers<C>& c) {
  const T gap = T(c.firm) * (distance - T(c.radius) - T(c.lift));
  const C friction = shape.grid ? sqrt(dot(n, n)) * c.friction : c.friction;
  const C* loss = c.dissipates ? &c.loss : nullptr;
  Touch<T> t{contact_force(gap, unit_normal(shape, n), z - c.from, c.carried, friction, c.kappa, loss), {}};
  if (any(t.pushes)) t.force = t.normal * n + t.tangential;
  return t;
}

template <class Shape, class T>
Touch<T> touch(const Shape& shape, const Vec3<T>& z, const ContactNumbers<T>& c) {
  T at[3], distance, n[3];
  z.store(at);
  distance_from(shape, at, c.size, distance, n);
  return touch(shape, distance, Vec3<T>(n), z, c);
}

// The same numbers over a larger scalar.
template <class U, class T>
ContactNumbers<U> constants(const ContactNumbers<T>& c) {
  const auto vector = [](const Vec3<T>& v) { return Vec3<U>(U(v.x), U(v.y), U(v.z)); };
  ContactNumbers<U> u{vector(c.from), vector(c.carried), U(c.friction), U(c.radius),  U(c.kappa), {},
                      U(c.lift),      U(c.leaving),      U(c.loss),     c.dissipates, c.firm};
  for (int k = 0; k < most_sizes; ++k) u.size[k] = U(c.size[k]);
  return u;
}

template <class T>
Vec3<double> values_of(const Vec3<T>& v) {
  return {value_of(v.x), value_of(v.y), value_of(v.z)};
}

// Their values.
template <class T>
ContactNumbers<double> values_of(const ContactNumbers<T>& c) {
  ContactNumbers<double> v{values_of(c.from),
                           values_of(c.carried),
                           value_of(c.friction),
                           value_of(c.radius),
                           value_of(c.kappa),
                           {},
                           value_of(c.lift),
                           value_of(c.leaving),
                           value_of(c.loss),
                           c.dissipates,
                           c.firm};
  for (int k = 0; k < most_sizes; ++k) v.size[k] = value_of(c.size[k]);
  return v;
}

// A = -d force/dz of a contact that pushes, row by row, with the curvature of the shape.
template <class Shape, class V>
void curved_touch_matrix(const Shape& shape, const Vec3<V>& z, const ContactNumbers<V>& c, V* A) {
  using D = Dual<V, 3>;
  D at[3] = {D(z.x), D(z.y), D(z.z)}, force[3];
  for (int d = 0; d < 3; ++d) at[d].d[d] = V(1.0);
  touch(shape, Vec3<D>(at), constants<D>(c)).force.store(force);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) A[3 * a + b] = -force[a].d[b];
}

// The same, or without that curvature: then the normal stays, as Newton's method may have it. Returns what acts.
inline Touch<double> touch_matrix(const AnyShape& shape, const Vec3<double>& z, const ContactNumbers<double>& c,
                                  bool curved, double* A) {
  using D = Dual<double, 3>;
  double at[3], distance, n[3];
  z.store(at);
  distance_from(shape, at, c.size, distance, n);
  const Touch<double> plain = touch(shape, distance, Vec3<double>(n), z, c);
  std::fill_n(A, 9, 0.0);
  if (!plain.pushes) return plain;
  if (curved) {
    curved_touch_matrix(shape, z, c, A);
    return plain;
  }
  D zd[3], force[3], distance_d(distance);
  for (int d = 0; d < 3; ++d) {
    zd[d] = D(at[d]);
    zd[d].d[d] = 1.0;
    distance_d.d[d] = n[d];
  }
  touch(shape, distance_d, Vec3<double>(n), Vec3<D>(zd), c).force.store(force);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) A[3 * a + b] = -force[a].d[b];
  return plain;
}

}  // namespace sheetbend
