// attachment: C = x0 - x1 - offset, a vector of 3  [m]. Ties particle x0 to x1, at a fixed offset in space: to a driven particle as to a moving
// target, or to the one that carries a clamp, which then moves without turning. Compliance in m/N (0 = rigid). Its gradient is constant; the
// target's motion gets its gradient as the boundary's.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

struct Attachment : OnPoints<2> {
  static constexpr const char* name = "attachment";
  static constexpr const char* about = "the way from the second particle to the first, less an offset";
  static constexpr Unit unit = units::meters;
  static constexpr Compliance compliance{"displacement / force"};
  static constexpr bool hot = true;
  static constexpr int rows = 3;
  static constexpr std::array parameters{Parameter{"offset_x", units::meters, ranges::any, defaults::usually(0.0)},
                                         Parameter{"offset_y", units::meters, ranges::any, defaults::usually(0.0)},
                                         Parameter{"offset_z", units::meters, ranges::any, defaults::usually(0.0)}};
  static constexpr int offsets = 3;

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    for (int i = 0; i < 3; ++i) {
      C[i] = x[i] - x[3 + i] - p[i];
      for (int k = 0; k < 6; ++k) J[6 * i + k] = T(k == i ? 1.0 : k == 3 + i ? -1.0 : 0.0);
    }
  }

  template <class T>
  static void add_hessian(const T*, const T*, const T*, T*) {}
};

}  // namespace sheetbend
