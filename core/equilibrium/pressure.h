// Pressure on triangles at rest. Each pushes its corners with p/6 N, N = (x1 - x0) x (x2 - x0). Where pressures are alike all around every
// free particle (a closed surface, a held rim), that is the gradient of
//
//   sum p V,  V = x0 . (x1 x x2) / 6   below a triangle,
//
// so -sum p V is an energy, with a symmetric Hessian. Elsewhere there is none, and equilibria are refused.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "core/scalar/vec3.h"
#include "core/scene/scene.h"

namespace sheetbend {

// Calls f(triangle, nodes, pressure).
template <class T, class F>
void for_each_pressed(const Scene& scene, const Inputs<const T>& in, F&& f) {
  for (std::size_t i = 0; i < scene.air.size(); ++i) f(static_cast<int>(i), scene.air[i], in.of(Quantity::pressure)[i]);
}

template <class T>
std::array<Vec3<T>, 3> corners_at(const Scene& scene, const std::array<int, 3>& nodes, const T* x) {
  const auto at = [&](int k) { return Vec3<T>(x + scene.first_dof[nodes[k]]); };
  return {at(0), at(1), at(2)};
}

// Adds the forces on free particles to f (dofs).
template <class T>
void add_pressure_forces(const Scene& scene, const Inputs<const T>& in, const T* x, T* f) {
  for_each_pressed(scene, in, [&](int, const std::array<int, 3>& nodes, const T& p) {
    const auto [a, b, c] = corners_at(scene, nodes, x);
    const Vec3<T> push = (T(1.0 / 6.0) * p) * cross(b - a, c - a);
    for (const int n : nodes)
      if (scene.inertial[n]) push.add_to(f + scene.first_dof[n]);
  });
}

inline double pressure_energy(const Scene& scene, const Inputs<const double>& in, const double* x) {
  double sum = 0.0;
  for_each_pressed(scene, in, [&](int, const std::array<int, 3>& nodes, double p) {
    const auto [a, b, c] = corners_at(scene, nodes, x);
    sum -= p / 6.0 * dot(a, cross(b, c));
  });
  return sum;
}

// H (9 x 9) = p Hess(V).
inline void pressure_hessian(const std::array<Vec3<double>, 3>& at, double p, double* H) {
  std::fill_n(H, 81, 0.0);
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3;
    // the gradient with respect to corner a is (b x c)/6, and v x c = -[c] v
    const Vec3<double> c = p / 6.0 * at[(a + 2) % 3];
    const double by_b[3][3] = {{0.0, c.z, -c.y}, {-c.z, 0.0, c.x}, {c.y, -c.x, 0.0}};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) H[9 * (3 * a + i) + 3 * b + j] = H[9 * (3 * b + j) + 3 * a + i] = by_b[i][j];
  }
}

// A free particle around which the forces have no energy, or -1. With corners (n, i, j) they differ from the gradient by
// sum p x_n x (x_i - x_j)/6, which has to vanish whatever the shape.
inline int without_energy(const Scene& scene, const Inputs<const double>& in) {
  std::vector<std::tuple<int, int, double>> shares;  // of neighbors
  for_each_pressed(scene, in, [&](int, const std::array<int, 3>& nodes, double p) {
    for (int k = 0; k < 3; ++k)
      if (p != 0.0 && scene.role[nodes[k]] == Role::free) {
        shares.emplace_back(nodes[k], nodes[(k + 1) % 3], p);
        shares.emplace_back(nodes[k], nodes[(k + 2) % 3], -p);
      }
  });
  std::sort(shares.begin(), shares.end());
  for (std::size_t i = 0; i < shares.size();) {
    const auto [n, neighbor, first] = shares[i];
    double sum = 0.0, size = 0.0;
    for (; i < shares.size() && std::get<0>(shares[i]) == n && std::get<1>(shares[i]) == neighbor; ++i) {
      sum += std::get<2>(shares[i]);
      size += std::abs(std::get<2>(shares[i]));
    }
    if (std::abs(sum) > 1e-9 * size) return n;
  }
  return -1;
}

}  // namespace sheetbend
