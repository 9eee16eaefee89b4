// The contract of a constraint. An author writes the vector C(x) and its gradient once, over any scalar; second derivatives,
// parameter derivatives, projection, adjoint, lanes and tests follow from that.
//
//   struct Distance : OnPoints<2> {                                 the stencil: how many particles, in order
//     static constexpr const char* name = "distance";
//     static constexpr const char* about = "the distance ...";      in one line, for lists
//     static constexpr Unit unit = units::meters;                   of C; the units of compliance and damping follow
//     static constexpr Compliance compliance{"link length / EA"};   what makes it, scalar or matrix, whether it may be zero
//     static constexpr int rows = 1;                                how many scalar constraints
//     static constexpr std::array parameters{...};                  values inside C that differ per constraint: name, unit, range, default (parameter.h)
//     template <class T> static void evaluate(const T* x, const T* p, T* C, T* J);
//   };
//
// x holds the stencil's coordinates one node after the other (dofs of them), J is row-major (rows x dofs) and fully written.
// `points` of the stencil are points; those after them are directors (of a rod's edges), `axes` of bodies (core/scene/bodies.h), or internal variables
// (see yield.h).
// `unilateral = true` (one row): C >= 0, a constraint that pushes and never pulls. Its multiplier stays lambda >= 0.
// `hot = true`: its kernels are inlined as a whole, which costs compile time and bytes and pays where the kind decides how long a simulation takes.
// `hot_in_blocks = true`: the same of its kernels in direct blocks alone.
// `periodic = true` says that C is an angle: differences of it (rate damping) are taken the short way round.
//
// Shortcuts make hot constraints cheaper; a constraint without them works the same, and tests compare the two routes:
//   `unit_gradients = true` (one row): |dC/dx_k| = 1 on every particle k whatever x is. Then J W J^T = sum w, and its derivative,
//     2 Hess(C) W J^T, is zero.
//   `offsets = m`: the last m parameters are subtracted from the first m rows, so the reverse knows their derivatives.
//   `factors = 1`: the first parameter multiplies all of the last row but what is subtracted, so the reverse knows its derivatives too.
//   template <class T> struct Geometry: what the reverse can use in place of x and dual numbers, where the parameters are
//     subtracted, C = f(x) - p. It has `size` numbers, Geometry(x), keep(to), kept(from), values(p, C), gradient(J) and
//     add_hessian_times(v, out) for one row. See distance.h.
//   template <class T> struct Factors: C, and J as a product of few numbers, for constraints of several rows. It has Factors(x, p), C, gradient(J), and
//     what a projection makes of J without writing it down: matrix(w, A), add_times(v, y) and transpose_times(y, out), as in
//     core/element/linearization.h. See membrane.h.
//   template <class T> static void reverse(x, p, dl, y, a, b, x_bar, p_bar): of sum_j (v_j . J_j - y_j C_j) with v_j = dl_j a - y_j b, where dl, y (rows)
//     and a, b (dofs) do not vary, the derivatives with respect to J's x, Hess(C_j) v_j, and by p, added to x_bar and p_bar: what
//     dual numbers otherwise find with a direction for each row and parameter. See membrane.h.
//   template <class T> static void add_hessian(x, p, lambda, H): adds sum_j lambda_j Hess(C_j), its lower triangle row after row, to H: what dual
//     numbers otherwise find with a direction per coordinate (core/element/second_order.h).
#pragma once

#include <algorithm>
#include <array>

#include "core/constraints/parameter.h"
#include "core/scalar/vec3.h"

namespace sheetbend {

template <int Arity>
struct OnPoints {
  static constexpr int arity = Arity;
  static constexpr int dofs = 3 * Arity;
  static constexpr int points = Arity, axes = 0;
  static constexpr int offsets = 0, factors = 0;
  static constexpr bool periodic = false;
  static constexpr bool unilateral = false;
  static constexpr bool unit_gradients = false;
  static constexpr bool hot = false, hot_in_blocks = false;
  static constexpr const char* instead_of_rest =
      nullptr;  // what to use where somebody gives values that the kind does not have
};

template <class K>
inline constexpr int parameter_count = static_cast<int>(K::parameters.size());

template <class K>
concept HasGeometry = requires { K::template Geometry<double>::size; };

template <class K>
concept HasReverse = requires(const double* in, double* out) { K::reverse(in, in, in, in, in, in, out, out); };

template <class K>
concept HasFactors = requires(const typename K::template Factors<double>& factors) { factors.C; };

template <class K>
concept HasHessian = requires(const double* in, double* out) { K::add_hessian(in, in, in, out); };

// Kinds with a set: their last node moves at the end of a substep as yield.h says.
template <class K>
inline constexpr bool Yields = requires { K::yield_parameter; };

// Kinds that a balance of forces can have (core/solver/implicit_block.h): those that always hold.
template <class K>
inline constexpr bool balances = !K::unilateral;

// Numbers of the lower triangle of a symmetric matrix of n rows, row after row.
constexpr int triangle(int n) { return n * (n + 1) / 2; }

// Adds the 3 x 3 numbers that belong to particles i and k of a stencil; of i = k the lower ones count.
template <class T>
void add_to_triangle(int i, int k, const T* block, T* H) {
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < (i == k ? a + 1 : 3); ++b)
      H[i >= k ? triangle(3 * i + a) + 3 * k + b : triangle(3 * k + b) + 3 * i + a] += block[3 * a + b];
}

// What a projection leaves for its reverse: the constraint's own geometry, otherwise the coordinates (where they are).
template <class K, class T>
struct Kept {
  static constexpr int size = K::dofs;
  const T* x;
  explicit Kept(const T* from) : x(from) {}
  static Kept kept(const T* from) { return Kept(from); }
};
template <HasGeometry K, class T>
struct Kept<K, T> : K::template Geometry<T> {
  using Base = typename K::template Geometry<T>;
  explicit Kept(const T* x) : Base(x) {}
  static Kept kept(const T* from) { return Kept(Base::kept(from)); }

 private:
  explicit Kept(const Base& base) : Base(base) {}
};

// C and J of one constraint, on the stack.
template <class K, class T>
struct Evaluation {
  T C[K::rows];
  T J[K::rows * K::dofs];
  Evaluation(const T* x, const T* p) { K::evaluate(x, p, C, J); }
};

template <class K, class T>
[[gnu::noinline]] void evaluate_apart(const T* x, const T* p, T* C, T* J) {
  K::evaluate(x, p, C, J);
}

// C and J where speed does not matter: one function of a kind for all who ask, instead of a copy in each of them.
template <class K, class T>
struct SharedEvaluation {
  T C[K::rows];
  T J[K::rows * K::dofs];
  SharedEvaluation(const T* x, const T* p) { evaluate_apart<K>(x, p, C, J); }
};

// C and J on dual numbers of N directions. With many of them the work is all in memory, and inlining it into every kernel takes
// compilers minutes; with few it pays.
template <class K, int N, class T>
[[gnu::always_inline]] inline void evaluate_on_duals(const T* x, const T* p, T* C, T* J) {
  if constexpr (N > 7)
    evaluate_apart<K>(x, p, C, J);
  else
    K::evaluate(x, p, C, J);
}

// a - b, for angles the short way round.
template <class K, class T>
T difference(const T& a, const T& b) {
  T d = a - b;
  if constexpr (K::periodic) {
    constexpr double turn = 6.283185307179586476925;
    d = d - T(turn) * nearest(d * T(1.0 / turn));
  }
  return d;
}

}  // namespace sheetbend
