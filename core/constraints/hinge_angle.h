// The angle between two triangles (x0, x1, a) and (x1, x0, b) that share the edge x0x1, and its gradient: zero when flat, positive where their
// normals lean towards each other; by atan2, never acos (Bridson et al. 2003; gradient: Tamstorf & Grinspun 2013).
// Degenerate: a triangle without area.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

template <class T>
struct HingeAngle {
  T value;
  Vec3<T> by_x0, by_x1, by_a, by_b;

  HingeAngle(const Vec3<T>& x0, const Vec3<T>& x1, const Vec3<T>& a, const Vec3<T>& b) {
    const Vec3<T> e = x1 - x0, to_a = a - x0, to_b = b - x0;
    const Vec3<T> normal_a = cross(e, to_a), normal_b = cross(to_b, e);
    const T length2 = dot(e, e), length = sqrt(length2), inverse = T(1.0) / length2;
    value = atan2(length * dot(normal_a, to_b), dot(normal_a, normal_b));
    by_a = (length / dot(normal_a, normal_a)) * normal_a;
    by_b = (length / dot(normal_b, normal_b)) * normal_b;
    const T foot_a = dot(to_a, e) * inverse, foot_b = dot(to_b, e) * inverse;  // of the heights, along the edge
    by_x1 = -(foot_a * by_a) - foot_b * by_b;
    by_x0 = -by_x1 - by_a - by_b;
  }
};

// Adds scale Hess(angle) to the matrix H of a stencil (lower triangle, see concept.h) in which x0, x1, a, b are particles nodes[0 .. 3]. Per side, with its
// normal n, its height h over the edge e at the share f of it, and S = n h^T + h n^T:
//   Hess_aa = -|e|^3/|n|^4 S     Hess_a1 = -f Hess_aa - q e n^T     Hess_11 = f^2 Hess_aa - q S/2 + f q (n e^T + e n^T)     q = 1/(|e| |n|^2)
// and what belongs to x0 makes all sums zero.
template <class T>
void add_angle_hessian(const T* x, const int* nodes, const T& scale, T* H) {
  const auto at = [&](int k) { return Vec3<T>(x + 3 * nodes[k]); };
  const Vec3<T> e = at(1) - at(0);
  const T length2 = dot(e, e), inverse2 = T(1.0) / length2, length = sqrt(length2), one(1.0), half(0.5);
  T H_00[9], H_10[9], H_11[9];
  for (int d = 0; d < 9; ++d) H_00[d] = H_10[d] = H_11[d] = T(0.0);
  for (int side = 2; side < 4; ++side) {
    const Vec3<T> to = at(side) - at(0), n = side == 2 ? cross(e, to) : cross(to, e);
    const T foot = dot(to, e) * inverse2, rest = one - foot;
    const T inverse = one / dot(n, n), q = scale * inverse * (length * inverse2);
    const Vec3<T> h = to - foot * e;
    const T c = scale * (length2 * length) * (inverse * inverse);
    const T ns[] = {n.x, n.y, n.z}, es[] = {e.x, e.y, e.z}, hs[] = {h.x, h.y, h.z};
    T own[9], by_1[9], by_0[9];
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) {
        const int at_ik = 3 * i + k;
        const T S = ns[i] * hs[k] + hs[i] * ns[k], en = q * (es[i] * ns[k]), ne = q * (ns[i] * es[k]);
        const T aa = -(c * S), turn = half * (q * S);
        own[at_ik] = aa;
        by_1[at_ik] = -(foot * aa) - en;
        by_0[at_ik] = en - rest * aa;
        H_11[at_ik] += foot * (foot * aa + ne + en) - turn;
        H_10[at_ik] += foot * (rest * aa - en) + rest * ne + turn;
        H_00[at_ik] += rest * (rest * aa - ne - en) - turn;
      }
    add_to_triangle(nodes[side], nodes[side], own, H);
    add_to_triangle(nodes[side], nodes[1], by_1, H);
    add_to_triangle(nodes[side], nodes[0], by_0, H);
  }
  add_to_triangle(nodes[0], nodes[0], H_00, H);
  add_to_triangle(nodes[1], nodes[0], H_10, H);
  add_to_triangle(nodes[1], nodes[1], H_11, H);
}

}  // namespace sheetbend
