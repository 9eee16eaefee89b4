// The derivative of a static equilibrium by every input, by the implicit function theorem. With A = [H, J^T; J, alpha] at the solution,
//
//   tangents:    A (x_dot, lambda_dot) = -(dr/dp) p_dot           r = (r_x, r_l) of residual.h, x of the fixed nodes being inputs
//   cotangents:  A (u, v) = (x_bar, lambda_bar),  p_bar = -(dr/dp)^T (u, v)
//
// No derivative of a constraint is typed: tangents are the residual on duals; for cotangents (dr/dp)^T (u, v) is the gradient with respect to p of
// sum_j lambda_j u . grad C_j + v_j C_j, one evaluation of each constraint on duals with 1 + parameters directions.
#pragma once

#include <vector>

#include "adjoint/equilibrium/equilibrium_tangents.h"
#include "core/equilibrium/equilibrium.h"
#include "core/equilibrium/residual.h"
#include "core/equilibrium/resting.h"
#include "core/scalar/complex.h"
#include "core/scalar/dual.h"

namespace sheetbend {

// The first-order parts of a scalar.
template <class T>
struct Tangents;
template <int N>
struct Tangents<Dual<double, N>> {
  static constexpr int count = N;
  static double& part(Dual<double, N>& a, int i) { return a.d[i]; }
};
template <>
struct Tangents<Complex> {
  static constexpr int count = 1;
  static double& part(Complex& a, int) { return a.im; }
};

class EquilibriumDerivative {
 public:
  // Factors A once. Throws NoEquilibrium where the result did not converge or A is singular (a fold, or a part that moves freely).
  EquilibriumDerivative(const Scene& scene, const double* inputs, const Equilibrium& at);

  // inputs_bar (layout.total()) += gradient, given x_bar (dofs) and lambda_bar (multipliers); either may be null.
  void vjp(const double* x_bar, const double* lambda_bar, double* inputs_bar) const;

  // Coordinates (dofs) and multipliers (may be null) with their first-order parts, from inputs that carry some.
  template <class T>
  void jvp(const T* inputs, T* x, T* lambda) const;

 private:
  void solve(std::vector<double>& x, std::vector<double>& lambda, bool transposed) const;

  const Scene& scene_;
  std::vector<double> inputs_;
  Equilibrium at_;
  Kkt kkt_;
};

template <class T>
void EquilibriumDerivative::jvp(const T* inputs, T* x, T* lambda) const {
  const Inputs<const T> in{scene_.layout, inputs};
  std::vector<T> at_x(at_.x.begin(), at_.x.end()), at_lambda(at_.lambda.begin(), at_.lambda.end());
  place_fixed(scene_, in, at_.t0, at_x.data());
  std::vector<T> r_x(at_x.size()), r_l(at_lambda.size());
  equilibrium_residual(scene_, in, at_.t0, at_x.data(), at_lambda.data(), r_x.data(), r_l.data());
  const std::vector<T> held(at_.held.begin(), at_.held.end());
  RestingContacts<T>(scene_, in, at_.t0, held.empty() ? in.of(Quantity::position) : held.data())
      .add_forces(at_x.data(), r_x.data());
  std::vector<double> x_dot(r_x.size()), lambda_dot(r_l.size());
  for (int k = 0; k < Tangents<T>::count; ++k) {
    for (std::size_t i = 0; i < r_x.size(); ++i) x_dot[i] = -Tangents<T>::part(r_x[i], k);
    for (std::size_t i = 0; i < r_l.size(); ++i) lambda_dot[i] = -Tangents<T>::part(r_l[i], k);
    for (const RedundantRow& r : at_.left_out) lambda_dot[r.row] = 0.0;
    solve(x_dot, lambda_dot, false);
    for (std::size_t i = 0; i < r_x.size(); ++i) Tangents<T>::part(at_x[i], k) += x_dot[i];
    for (std::size_t i = 0; i < r_l.size(); ++i) Tangents<T>::part(at_lambda[i], k) = lambda_dot[i];
  }
  retract_directors(scene_, at_x.data());
  std::copy(at_x.begin(), at_x.end(), x);
  if (lambda) std::copy(at_lambda.begin(), at_lambda.end(), lambda);
}

// Compiled in equilibrium_tangents.cpp.
extern template void EquilibriumDerivative::jvp(const Dual<double, 1>*, Dual<double, 1>*, Dual<double, 1>*) const;
extern template void EquilibriumDerivative::jvp(const Dual<double, 4>*, Dual<double, 4>*, Dual<double, 4>*) const;
extern template void EquilibriumDerivative::jvp(const Dual<double, 8>*, Dual<double, 8>*, Dual<double, 8>*) const;

}  // namespace sheetbend
