// distance: C = |x1 - x0| - rest_length  [m].
// Compliance alpha = l / EA [m/N] makes a link of length l of a rope with axial stiffness EA [N] (Macklin et al. 2016, eq. 18).
// Degenerate: coincident particles have no direction; their gradient is zero, so nothing pushes them apart.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

struct Distance : OnPoints<2> {
  static constexpr const char* name = "distance";
  static constexpr const char* about = "the distance of two particles less a rest length";
  static constexpr Unit unit = units::meters;
  static constexpr Compliance compliance{"link length / EA"};
  static constexpr bool hot = true;
  static constexpr int rows = 1;
  static constexpr std::array parameters{Parameter{"rest_length", units::meters, ranges::positive, defaults::measured}};
  static constexpr bool unit_gradients = true;

  // The direction and the length of the edge; Hess(C) = (I - n n^T) / length between its ends.
  template <class T>
  struct Geometry {
    static constexpr int size = 4;
    Vec3<T> n;
    T inverse, length;  // 1 / length; both 0 where the ends coincide

    explicit Geometry(const T* x) {
      Vec3<T> e = Vec3<T>(x + 3) - Vec3<T>(x);
      T length2 = dot(e, e);
      auto apart = length2 > T(0.0);
      T root = sqrt(select(apart, length2, T(1.0)));
      length = select(apart, root, T(0.0));
      inverse = select(apart, T(1.0) / root, T(0.0));
      n = inverse * e;
    }
    void keep(T* to) const {
      n.store(to);
      to[3] = inverse;
    }
    static Geometry kept(const T* from) { return Geometry(Vec3<T>(from), from[3]); }

    void values(const T* p, T* C) const { C[0] = length - p[0]; }
    void gradient(T* J) const {
      (-n).store(J);
      n.store(J + 3);
    }
    void add_hessian_times(const T* v, T* out) const {
      Vec3<T> e = Vec3<T>(v + 3) - Vec3<T>(v), turn = inverse * (e - dot(n, e) * n);
      (-turn).add_to(out);
      turn.add_to(out + 3);
    }

   private:
    Geometry(const Vec3<T>& n_, const T& inverse_) : n(n_), inverse(inverse_), length(inverse_or_zero(inverse_)) {}
  };

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const Geometry<T> at(x);
    at.values(p, C);
    at.gradient(J);
  }
};

}  // namespace sheetbend
