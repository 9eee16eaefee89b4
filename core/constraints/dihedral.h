// dihedral: C = theta - rest, the angle between two triangles (x0, x1, a) and (x1, x0, b) that share the edge x0x1  [rad], zero when flat and positive
// where their normals lean towards each other; theta = atan2, never acos (Bridson et al. 2003; gradient: Tamstorf & Grinspun 2013).
// Stencil x0, x1, a, b. For a sheet of bending stiffness B [N m]: alpha = (A_a + A_b)/(|e|^2 B)  [rad/(N m)] with the areas and the edge at
// rest. The energy B |e|^2 theta^2 / (2 (A_a + A_b)) is that of a cylinder on meshes without preferred diagonals, three times it or more along those
// that have them. Degenerate: a triangle without area. The angle is periodic.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

struct Dihedral : OnPoints<4> {
  static constexpr const char* name = "dihedral";
  static constexpr int rows = 1;
  static constexpr std::array<const char*, 1> parameters{"rest"};
  static constexpr int offsets = 1;
  static constexpr bool periodic = true;

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const Vec3<T> x0(x), x1(x + 3), a(x + 6), b(x + 9);
    const Vec3<T> e = x1 - x0;
    const Vec3<T> normal_a = cross(e, a - x0), normal_b = cross(b - x0, e);
    const T length = norm(e), one(1.0);
    C[0] = difference<Dihedral>(atan2(length * dot(normal_a, b - x0), dot(normal_a, normal_b)), p[0]);

    const Vec3<T> by_a = (length / dot(normal_a, normal_a)) * normal_a,
                  by_b = (length / dot(normal_b, normal_b)) * normal_b;
    const T inverse = one / (length * length);
    const T share_a = dot(a - x0, e) * inverse, share_b = dot(b - x0, e) * inverse;  // where the heights meet the edge
    ((share_a - one) * by_a + (share_b - one) * by_b).store(J);
    (-(share_a * by_a) - share_b * by_b).store(J + 3);
    by_a.store(J + 6);
    by_b.store(J + 9);
  }
};

}  // namespace sheetbend
