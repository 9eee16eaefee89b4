// brick_volume, tetrahedron_volume: C = V - rest, the volume of an element less its own at rest  [m^3]. With the rest volume V0 and alpha = V0/lambda [m^3/Pa]
// the energy is lambda V0 (J - 1)^2/2 with the mean J = V/V0 of the element: one row, so that a brick whose material hardly changes its volume does not lock
// (selective integration: Malkus & Hughes 1978). Compliance 0 is incompressible.
// Nodes of a brick: four around one face, counterclockwise seen from inside, then those across from them; its faces are bilinear, and V is the volume that they
// enclose, the mean of those of both ways to split each face into triangles. Nodes of a tetrahedron: the fourth lies to where (x1 - x0) x (x2 - x0) points.
// Nothing is degenerate; the volume of an element that is turned inside out is negative.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

// block = factor [v]x, the matrix that makes v x u of u.
template <class T>
void cross_matrix(double factor, const Vec3<T>& v, T* block) {
  const Vec3<T> s = T(factor) * v;
  const T zero(0.0), matrix[9] = {zero, -s.z, s.y, s.z, zero, -s.x, -s.y, s.x, zero};
  std::copy_n(matrix, 9, block);
}

struct BrickVolume : OnPoints<8> {
  static constexpr const char* name = "brick_volume";
  static constexpr const char* about = "the volume of a brick of eight nodes less that at rest";
  static constexpr Unit unit = units::cubic_meters;
  static constexpr Compliance compliance{"volume / lambda, 0 for an incompressible material"};
  static constexpr int rows = 1;
  static constexpr std::array parameters{Parameter{"rest", units::cubic_meters, ranges::positive, defaults::measured}};
  static constexpr int offsets = 1;

  static constexpr int faces[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                      {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};

  // A face a, b, c, d encloses with the origin (det(a, b, c) + det(a, c, d) + det(a, b, d) + det(b, c, d))/12.
  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const T share(1.0 / 12.0), third(1.0 / 3.0);
    T volume(0.0);
    for (int d = 0; d < dofs; ++d) J[d] = T(0.0);
    for (const auto& face : faces) {
      const auto at = [&](int i) { return Vec3<T>(x + 3 * face[i]) - Vec3<T>(x); };
      const Vec3<T> a = at(0), b = at(1), c = at(2), d = at(3);
      const Vec3<T> ab = cross(a, b), bc = cross(b, c), cd = cross(c, d), da = cross(d, a), bd = cross(b, d),
                    ca = cross(c, a);
      const Vec3<T> by_a = share * (bc + cd + bd), by_b = share * (cd + da + ca), by_c = share * (da + ab - bd),
                    by_d = share * (ab + bc - ca);
      by_a.add_to(J + 3 * face[0]);
      by_b.add_to(J + 3 * face[1]);
      by_c.add_to(J + 3 * face[2]);
      by_d.add_to(J + 3 * face[3]);
      volume += dot(a, by_a) + dot(b, by_b) + dot(c, by_c) + dot(d, by_d);
    }
    C[0] = third * volume - p[0];
  }

  template <class T>
  static void add_hessian(const T* x, const T*, const T* lambda, T* H) {
    T block[9];
    for (const auto& face : faces) {
      const auto at = [&](int i) { return lambda[0] * (Vec3<T>(x + 3 * face[i]) - Vec3<T>(x)); };
      const Vec3<T> a = at(0), b = at(1), c = at(2), d = at(3);
      const auto add = [&](int i, int k, const Vec3<T>& v) {
        cross_matrix(1.0 / 12.0, v, block);
        add_to_triangle(face[i], face[k], block, H);
      };
      add(0, 1, -(c + d));
      add(0, 2, b - d);
      add(0, 3, b + c);
      add(1, 2, -(a + d));
      add(1, 3, c - a);
      add(2, 3, -(a + b));
    }
  }
};

struct TetrahedronVolume : OnPoints<4> {
  static constexpr const char* name = "tetrahedron_volume";
  static constexpr const char* about = "the volume of a tetrahedron less that at rest";
  static constexpr Unit unit = units::cubic_meters;
  static constexpr Compliance compliance{"volume / lambda, 0 for an incompressible material"};
  static constexpr int rows = 1;
  static constexpr std::array parameters{Parameter{"rest", units::cubic_meters, ranges::positive, defaults::measured}};
  static constexpr int offsets = 1;

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const auto edge = [x](int k) { return Vec3<T>(x + 3 * k) - Vec3<T>(x); };
    const Vec3<T> e1 = edge(1), e2 = edge(2), e3 = edge(3);
    const T sixth(1.0 / 6.0);
    const Vec3<T> by_1 = sixth * cross(e2, e3), by_2 = sixth * cross(e3, e1), by_3 = sixth * cross(e1, e2);
    C[0] = dot(e1, by_1) - p[0];
    (-(by_1 + by_2 + by_3)).store(J);
    by_1.store(J + 3);
    by_2.store(J + 6);
    by_3.store(J + 9);
  }

  template <class T>
  static void add_hessian(const T* x, const T*, const T* lambda, T* H) {
    const auto edge = [&](int k) { return lambda[0] * (Vec3<T>(x + 3 * k) - Vec3<T>(x)); };
    const Vec3<T> e1 = edge(1), e2 = edge(2), e3 = edge(3);
    T block[9];
    const auto add = [&](int i, int k, const Vec3<T>& v) {
      cross_matrix(1.0 / 6.0, v, block);
      add_to_triangle(i, k, block, H);
    };
    add(1, 2, -e3);
    add(1, 3, e2);
    add(2, 3, -e1);
    add(1, 0, e3 - e2);
    add(2, 0, e1 - e3);
    add(3, 0, e2 - e1);
  }
};

}  // namespace sheetbend
