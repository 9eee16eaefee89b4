// distance_field: a cubic B-spline through distances that are given on a grid, C2 everywhere within it, so that neither forces nor their derivatives jump
// where the grid's cells meet. Beyond the grid the distance goes on as the distance from the grid more. The gradient has the length one as far as the
// spline follows the distance, which has kinks on edges and half way between surfaces; shapes.h makes it a unit vector where one is needed.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "core/contact/gap.h"

namespace sheetbend {

// What the spline is made of: coefficients at the grid's points and at one more on each side, the last axis fastest.
struct DistanceGrid {
  std::array<double, 3> origin;  // of the grid's first point, in the shape's frame [m]
  double spacing;                // m
  std::array<int, 3> count;      // of coefficients, two more than points
  std::vector<double> coefficients;
};

struct DistanceField {
  static constexpr const char* name = "distance_field";
  static constexpr const char* about = "the inside of a closed surface, by its distances on a grid";
  static constexpr std::array<const char*, 0> sizes{};

  template <class T>
  static void evaluate(const DistanceGrid& grid, const T* z, T& distance, T* n) {
    int cell[3];
    T weight[3][4], slope[3][4], out[3];
    bool beyond = false;
    for (int d = 0; d < 3; ++d) {
      const int last = grid.count[d] - 4;
      const T u = (z[d] - T(grid.origin[d])) * T(1.0 / grid.spacing);
      const double at = value_of(u) > 0.0 ? std::min(value_of(u), last + 1.0) : 0.0;  // of NaN too
      cell[d] = std::min(static_cast<int>(at), last);
      const bool within = value_of(u) == at;
      out[d] = within ? T(0.0) : z[d] - T(grid.origin[d] + at * grid.spacing);
      beyond = beyond || !within;
      weigh(within ? u - T(cell[d]) : T(at - cell[d]), weight[d], slope[d]);
      for (T& s : slope[d]) s = within ? T(1.0 / grid.spacing) * s : T(0.0);
    }
    distance = n[0] = n[1] = n[2] = T(0.0);
    for (int i = 0; i < 4; ++i) {
      T value(0.0), along_y(0.0), along_z(0.0);
      for (int j = 0; j < 4; ++j) {
        const double* c =
            &grid.coefficients[(static_cast<std::size_t>(cell[0] + i) * grid.count[1] + cell[1] + j) * grid.count[2] +
                               cell[2]];
        const T row = weight[2][0] * T(c[0]) + weight[2][1] * T(c[1]) + weight[2][2] * T(c[2]) + weight[2][3] * T(c[3]);
        const T steep = slope[2][0] * T(c[0]) + slope[2][1] * T(c[1]) + slope[2][2] * T(c[2]) + slope[2][3] * T(c[3]);
        value += weight[1][j] * row;
        along_y += slope[1][j] * row;
        along_z += weight[1][j] * steep;
      }
      distance += weight[0][i] * value;
      n[0] += slope[0][i] * value;
      n[1] += weight[0][i] * along_y;
      n[2] += weight[0][i] * along_z;
    }
    if (!beyond) return;
    T away[3];
    distance += normalize(Vec3<T>(out), {T(0.0), T(0.0), T(0.0)}, away);
    for (int d = 0; d < 3; ++d) n[d] += away[d];
  }

 private:
  // The four cubic B-splines over a cell, and their derivatives, at t from 0 to 1.
  template <class T>
  static void weigh(const T& t, T* weight, T* slope) {
    const T s = T(1.0) - t, t2 = t * t, s2 = s * s;
    weight[0] = T(1.0 / 6.0) * (s2 * s);
    weight[1] = T(2.0 / 3.0) - t2 + T(0.5) * (t2 * t);
    weight[2] = T(2.0 / 3.0) - s2 + T(0.5) * (s2 * s);
    weight[3] = T(1.0 / 6.0) * (t2 * t);
    slope[0] = T(-0.5) * s2;
    slope[1] = T(1.5) * t2 - T(2.0) * t;
    slope[2] = T(2.0) * s - T(1.5) * s2;
    slope[3] = T(0.5) * t2;
  }
};

}  // namespace sheetbend
