// The discrete curvature binormal at the middle of three points, kb = 2 e1 x e2 / (|e1||e2| + e1.e2), of length 2 tan(theta/2)
// (Bergou et al. 2008, eq. 1), and its gradient. Shared by bend and planar_bend.
// Degenerate when the two edges fold back on each other (theta = pi, the denominator vanishes) or have no length.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

template <class T>
struct CurvatureBinormal {
  Vec3<T> e1, e2, kb;
  T inverse;       // 1 / (|e1||e2| + e1.e2)
  Vec3<T> d1, d2;  // gradient of that denominator by e1 and e2

  explicit CurvatureBinormal(const T* x)
      : CurvatureBinormal(Vec3<T>(x + 3) - Vec3<T>(x), Vec3<T>(x + 6) - Vec3<T>(x + 3)) {}
  CurvatureBinormal(const Vec3<T>& first, const Vec3<T>& second) : e1(first), e2(second) {
    const T l1 = norm(e1), l2 = norm(e2);
    inverse = 1.0 / (l1 * l2 + dot(e1, e2));
    kb = 2.0 * inverse * cross(e1, e2);
    d1 = (l2 * (1.0 / l1)) * e1 + e2;  // frames want these inverses too
    d2 = (l1 * (1.0 / l2)) * e2 + e1;
  }

  // Writes the gradients of the three components (whose values are c) by the three points, row by row.
  void gradients(const T* c, T* J) const {
    const T zero(0.0), one(1.0);
    row({one, zero, zero}, c[0], J);
    row({zero, one, zero}, c[1], J + 9);
    row({zero, zero, one}, c[2], J + 18);
  }

  // The gradient of u . kb, of value c, by the two edges.
  void gradient(const Vec3<T>& u, const T& c, Vec3<T>& by_e1, Vec3<T>& by_e2) const {
    by_e1 = inverse * (2.0 * cross(e2, u) - c * d1);
    by_e2 = inverse * (2.0 * cross(u, e1) - c * d2);
  }

 private:
  void row(const Vec3<T>& u, const T& c, T* J) const {
    Vec3<T> g1, g2;
    gradient(u, c, g1, g2);
    (-g1).store(J);
    (g1 - g2).store(J + 3);
    g2.store(J + 6);
  }
};

}  // namespace sheetbend
