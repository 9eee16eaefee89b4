// bend: C = curvature binormal at the middle of three points, a vector of 3, straight at rest  [-].
// Compliance alpha = l / EI [1/(N m)] with the Voronoi length l gives the energy EI |kb|^2 / (2 l) of an isotropic rod
// (Bergou et al. 2008, eq. 2). Pure bending therefore carries M = (EI / l) 2 tan(phi/2) / cos^2(phi/2) at a joint turned by phi.
// Degenerate: straight, its gradient has rank 2 of 3, so the rigid form (compliance 0) is refused at validation.
#pragma once

#include "core/constraints/curvature.h"

namespace sheetbend {

struct Bend : OnPoints<3> {
  static constexpr const char* name = "bend";
  static constexpr const char* about = "the curvature binormal at the middle of three particles, straight at rest";
  static constexpr Unit unit = units::none;
  static constexpr Compliance compliance{"Voronoi length / EI", Compliance::scalar,
                                         "a straight rigid joint has a singular projection (rank 2 of 3)"};
  static constexpr bool hot = true;
  static constexpr const char* instead_of_rest = "use planar_bend with a plane normal, or a rod for a curve in space";
  static constexpr int rows = 3;
  static constexpr std::array<Parameter, 0> parameters{};

  template <class T>
  static void evaluate(const T* x, const T*, T* C, T* J) {
    const CurvatureBinormal<T> k(x);
    k.kb.store(C);
    k.gradients(C, J);
  }
};

}  // namespace sheetbend
