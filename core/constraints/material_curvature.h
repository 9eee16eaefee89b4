// material_curvature: C = (kappa1 - rest1, ratio kappa2 - rest2), the curvature binormal kb at a vertex in the material frame half way between
// those of its two edges  [-]: kappa1 = kb . m2, kappa2 = -kb . m1 (Bergou et al. 2010, eq. 2).
// Bergou's kappa is the mean over both frames, which twist shortens by cos(twist/2); the frame half way keeps |kappa| = |kb|, so that
// bending stiffness does not depend on twist. Compliance alpha = l / EI1 [1/(N m)] with the Voronoi length l, and ratio = sqrt(EI2 / EI1),
// give the energy (EI1 (kappa1 - rest1)^2 + EI2 (kappa2 - rest2 / ratio)^2) / (2 l). Degenerate as material_frame.h says, and half a turn of twist.
// section_curvature: the same between the normals of two sections.
#pragma once

#include "core/constraints/material_frame.h"

namespace sheetbend {

template <class Stencil>
struct CurvatureInFrames : Stencil {
  static constexpr Unit unit = units::none;
  static constexpr Compliance compliance{"Voronoi length / EI", Compliance::matrix};
  static constexpr int rows = 2;
  static constexpr std::array parameters{Parameter{"ratio", units::none, ranges::any, defaults::preset(1.0)},
                                         Parameter{"rest_1", units::none, ranges::any, defaults::usually(0.0)},
                                         Parameter{"rest_2", units::none, ranges::any, defaults::usually(0.0)}};
  static constexpr int offsets = 2, factors = 1;

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const Joint<Stencil, T> joint(x);
    const MaterialFrame<T>&first = joint.first, &second = joint.second;
    const T inverse = 1.0 / (1.0 + joint.cosine);  // cos^2(twist/2) = (1 + cos)/2
    const T to_mean = sqrt(0.5 * inverse);
    const Vec3<T> m1 = to_mean * (first.m1 + second.m1), m2 = to_mean * (first.m2 + second.m2);
    const T k1 = dot(m2, joint.curvature.kb), k2 = -dot(m1, joint.curvature.kb);
    const T half_tangent = 0.5 * joint.sine * inverse;  // of half the twist
    const Vec3<T> transport1 = half_tangent * joint.transport(first),
                  transport2 = half_tangent * joint.transport(second);

    // d(kappa) = m . d(kb), the turn of the frame half way, and its stretch by d(twist) as far as that is not turn
    const auto row = [&](const Vec3<T>& m, const T& k, const T& turned, const auto& scale, T* to) {
      Vec3<T> by_e1, by_e2;
      joint.curvature.gradient(m, k, by_e1, by_e2);
      const T turn = 0.5 * turned;
      joint.store(scale * (by_e1 + turn * first.by_axis + k * transport1),
                  scale * (by_e2 + turn * second.by_axis + k * transport2), (scale * turn) * first.by_director,
                  (scale * turn) * second.by_director, to);
    };
    C[0] = k1 - p[1];
    C[1] = p[0] * k2 - p[2];
    row(m2, k1, k2, 1.0, J);
    row(-m1, k2, -k1, p[0], J + Stencil::dofs);
  }
};

struct MaterialCurvature : CurvatureInFrames<OnJoint> {
  static constexpr const char* name = "material_curvature";
  static constexpr const char* about = "the curvatures of a rod at a joint, in its material frame, less those at rest";
  static constexpr bool hot = true;
};

struct SectionCurvature : CurvatureInFrames<OnSections> {
  static constexpr const char* name = "section_curvature";
  static constexpr const char* about = "the curvatures between two sections of a rod that shears, less those at rest";
};

}  // namespace sheetbend
