// The material frames of the two edges that meet at a vertex, and what turns between them (Bergou et al. 2010, sec. 4.2). An edge's frame is its
// tangent t and a director q, any vector that is not parallel to t: m1 = the part of q across t, of length one, and m2 = t x m1. The
// director is a coordinate of its own (quasi-static, see retract.h), so no frame has to be carried from one evaluation to the next.
//
// With P the shortest rotation of t1 onto t2: the twist is the angle from P m1 of the first edge to m1 of the second. Its derivative is
// d(twist) = d(angle 2) - d(angle 1) + kb . (dt1 + dt2)/2, where an edge's angle is that of m1 about t.
// Degenerate: an edge without length, a director along its edge, edges folded back on each other.
#pragma once

#include "core/constraints/curvature.h"
#include "core/scalar/across.h"

namespace sheetbend {

// The stencil of a joint: three points and the directors of the edges between them.
struct OnJoint : OnPoints<5> {
  static constexpr int points = 3;
};

template <class T>
struct MaterialFrame : Across<T> {
  Vec3<T> m2;
  Vec3<T> by_director, by_edge;  // gradient of the frame's angle

  MaterialFrame(const Vec3<T>& edge, const Vec3<T>& q) : Across<T>(edge, q) {
    m2 = cross(this->t, this->m1);
    by_director = this->inverse * m2;
    by_edge = -(this->along * this->inverse_length) * by_director;
  }
};

template <class T>
struct Joint {
  CurvatureBinormal<T> curvature;
  MaterialFrame<T> first, second;
  T cosine, sine;  // of the twist

  explicit Joint(const T* x)
      : curvature(x), first(curvature.e1, Vec3<T>(x + 9)), second(curvature.e2, Vec3<T>(x + 12)) {
    const T share = dot(second.m1, first.t) / (T(1.0) + dot(first.t, second.t));
    cosine = dot(first.m1, second.m1) - dot(first.m1, second.t) * share;
    sine = dot(first.m2, second.m1) - dot(first.m2, second.t) * share;
  }

  // The gradient from that by the edges and by the directors.
  static void store(const Vec3<T>& e1, const Vec3<T>& e2, const Vec3<T>& q1, const Vec3<T>& q2, T* J) {
    (-e1).store(J);
    (e1 - e2).store(J + 3);
    e2.store(J + 6);
    q1.store(J + 9);
    q2.store(J + 12);
  }

  // kb . (dt1 + dt2)/2, by an edge.
  Vec3<T> transport(const MaterialFrame<T>& frame) const { return (T(0.5) * frame.inverse_length) * curvature.kb; }
};

}  // namespace sheetbend
