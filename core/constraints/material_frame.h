// The material frames on the two sides of a joint, and what turns between them (Bergou et al. 2010, sec. 4.2). A frame has an axis t and a
// director q, any vector that is not parallel to t: m1 = the part of q across t, of length one, and m2 = t x m1. The axis is
// that of an edge; or, where sections may shear (shear.h), a section's normal n, a coordinate like q.
// Directors and normals are coordinates of their own (quasi-static, see core/step/retract_directors.h), so no frame has to be carried from one evaluation to the next.
//
// With P the shortest rotation of t1 onto t2: the twist is the angle from P m1 of the first frame to m1 of the second. Its derivative is
// d(twist) = d(angle 2) - d(angle 1) + kb . (dt1 + dt2)/2, where a frame's angle is that of m1 about t.
// Degenerate: an axis without length, a director along its axis, axes folded back on each other.
#pragma once

#include "core/constraints/curvature.h"
#include "core/scalar/across.h"

namespace sheetbend {

// The stencil of a joint: three points and the directors of the edges between them.
struct OnJoint : OnPoints<5> {
  static constexpr int points = 3;
  static constexpr int directors = 9;  // where the coordinates of the two begin

  template <class T>
  static Vec3<T> axis(const T* x, int k) {
    return Vec3<T>(x + 3 * k + 3) - Vec3<T>(x + 3 * k);
  }
  // The gradient from that by the axes.
  template <class T>
  static void store_by_axes(const Vec3<T>& first, const Vec3<T>& second, T* J) {
    (-first).store(J);
    (first - second).store(J + 3);
    second.store(J + 6);
  }
};

// The stencil between two sections: their normals, then their directors.
struct OnSections : OnPoints<4> {
  static constexpr int points = 0;
  static constexpr int directors = 6;

  template <class T>
  static Vec3<T> axis(const T* x, int k) {
    return Vec3<T>(x + 3 * k);
  }
  template <class T>
  static void store_by_axes(const Vec3<T>& first, const Vec3<T>& second, T* J) {
    first.store(J);
    second.store(J + 3);
  }
};

template <class T>
struct MaterialFrame : Across<T> {
  Vec3<T> m2;
  Vec3<T> by_director, by_axis;  // gradient of the frame's angle

  MaterialFrame(const Vec3<T>& axis, const Vec3<T>& q) : Across<T>(axis, q) {
    m2 = cross(this->t, this->m1);
    by_director = this->inverse * m2;
    by_axis = -(this->along * this->inverse_length) * by_director;
  }
};

template <class Stencil, class T>
struct Joint {
  CurvatureBinormal<T> curvature;
  MaterialFrame<T> first, second;
  T cosine, sine;  // of the twist

  explicit Joint(const T* x)
      : curvature(Stencil::axis(x, 0), Stencil::axis(x, 1)),
        first(curvature.e1, Vec3<T>(x + Stencil::directors)),
        second(curvature.e2, Vec3<T>(x + Stencil::directors + 3)) {
    const T share = dot(second.m1, first.t) / (1.0 + dot(first.t, second.t));
    cosine = dot(first.m1, second.m1) - dot(first.m1, second.t) * share;
    sine = dot(first.m2, second.m1) - dot(first.m2, second.t) * share;
  }

  // The gradient from that by the axes and by the directors.
  static void store(const Vec3<T>& e1, const Vec3<T>& e2, const Vec3<T>& q1, const Vec3<T>& q2, T* J) {
    Stencil::store_by_axes(e1, e2, J);
    q1.store(J + Stencil::directors);
    q2.store(J + Stencil::directors + 3);
  }

  // kb . (dt1 + dt2)/2, by an axis.
  Vec3<T> transport(const MaterialFrame<T>& frame) const { return (0.5 * frame.inverse_length) * curvature.kb; }
};

}  // namespace sheetbend
