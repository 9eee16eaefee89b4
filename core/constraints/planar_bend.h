// planar_bend: C = kb - rest n, a vector of 3: for curves in the plane with unit normal n, the signed curvature against its rest value  [-].
// Compliance alpha = l / EI as for bend; rest is the natural curvature [1/m] times the Voronoi length l. In the plane C has one component,
// along n; out of it the rod resists as bend does (with stiffness in the plane alone a hanging wire has many unstable sideways modes).
// A rest curvature of a rope that leaves its plane needs material frames, that is, a rod.
// Degenerate as bend: rank 2 of 3 when straight, so the rigid form is refused at validation.
#pragma once

#include "core/constraints/curvature.h"

namespace sheetbend {

struct PlanarBend : OnPoints<3> {
  static constexpr const char* name = "planar_bend";
  static constexpr const char* about = "the curvature binormal less a rest curvature in a plane";
  static constexpr Unit unit = units::none;
  static constexpr Compliance compliance{"Voronoi length / EI", Compliance::scalar,
                                         "a straight rigid joint has a singular projection (rank 2 of 3)"};
  static constexpr int rows = 3;
  static constexpr std::array parameters{Parameter{"normal_x", units::none, ranges::any, defaults::normal},
                                         Parameter{"normal_y", units::none, ranges::any, defaults::normal},
                                         Parameter{"normal_z", units::none, ranges::any, defaults::normal},
                                         Parameter{"rest", units::none, ranges::any, defaults::usually(0.0)}};

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const CurvatureBinormal<T> k(x);
    k.kb.store(C);
    k.gradients(C, J);
    for (int i = 0; i < 3; ++i) C[i] -= p[3] * p[i];
  }
};

}  // namespace sheetbend
