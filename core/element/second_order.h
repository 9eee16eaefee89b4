// C, J and the Hessians of one constraint: by hand where it has them (concept.h), otherwise on dual numbers with a direction per coordinate.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/dual.h"

namespace sheetbend {

template <class K, class T>
class SecondOrder {
 public:
  T C[K::rows], J[K::rows * K::dofs];

  SecondOrder(const T* x, const T* p) {
    D at[K::dofs], with[parameter_count<K> + 1], value[K::rows];
    for (int d = 0; d < K::dofs; ++d) {
      at[d].v = x[d];
      at[d].d[d] = T(1.0);
    }
    for (int k = 0; k < parameter_count<K>; ++k) with[k].v = p[k];
    evaluate_on_duals<K, K::dofs>(at, with, value, gradient_);
    for (int j = 0; j < K::rows; ++j) C[j] = value[j].v;
    for (int d = 0; d < K::rows * K::dofs; ++d) J[d] = gradient_[d].v;
  }

  // H += sum_j lambda_j Hess(C_j), the lower triangle row after row.
  void add_hessian(const T* lambda, T* H) const {
    for (int j = 0; j < K::rows; ++j)
      for (int a = 0; a < K::dofs; ++a)
        for (int b = 0; b <= a; ++b) H[triangle(a) + b] += lambda[j] * gradient_[j * K::dofs + a].d[b];
  }

 private:
  using D = Dual<T, K::dofs>;
  D gradient_[K::rows * K::dofs];
};

template <HasHessian K, class T>
class SecondOrder<K, T> : public Evaluation<K, T> {
 public:
  SecondOrder(const T* x, const T* p) : Evaluation<K, T>(x, p), x_(x), p_(p) {}
  void add_hessian(const T* lambda, T* H) const { K::add_hessian(x_, p_, lambda, H); }

 private:
  const T *x_, *p_;
};

}  // namespace sheetbend
