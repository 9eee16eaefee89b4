#include "core/solver/element_stiffness.h"

#include <Eigen/Eigenvalues>
#include <stdexcept>

#include "core/scalar/dual.h"

namespace sheetbend {
namespace {

constexpr int most_dofs = []<class... K>(std::tuple<K...>*) {
  return std::max({(holds_points<K> ? K::dofs : 0)...});
}(static_cast<Registry*>(nullptr));

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, most_dofs, most_dofs>;

template <class K>
void find_stiffness(const double* x, const double* parameters, double stiffness, const double* lambda, double* E) {
  using D = Dual<double, K::dofs>;
  constexpr int P = parameter_count<K>;
  D xd[K::dofs], p[P > 0 ? P : 1], C[K::rows], J[K::rows * K::dofs];
  for (int d = 0; d < K::dofs; ++d) {
    xd[d].v = x[d];
    xd[d].d[d] = 1.0;
  }
  for (int k = 0; k < P; ++k) p[k].v = parameters[k];
  evaluate_on_duals<K, K::dofs>(xd, p, C, J);
  for (int a = 0; a < K::dofs; ++a)
    for (int b = 0; b <= a; ++b) {
      double sum = 0.0;
      for (int j = 0; j < K::rows; ++j)
        sum += stiffness * (J[j * K::dofs + a].v * J[j * K::dofs + b].v) - lambda[j] * J[j * K::dofs + a].d[b];
      E[a * K::dofs + b] = E[b * K::dofs + a] = sum;
    }
}

}  // namespace

void element_stiffness(int kind, const double* x, const double* parameters, double stiffness, const double* lambda,
                       double* E) {
  with_kind(kind, [&]<class K>(K) {
    if constexpr (holds_points<K>)
      find_stiffness<K>(x, parameters, stiffness, lambda, E);
    else
      throw std::logic_error("element_stiffness: not of points alone");
  });
}

void make_convex(int dofs, double* E) {
  Eigen::Map<Matrix> matrix(E, dofs, dofs);
  const Eigen::SelfAdjointEigenSolver<Matrix> modes(matrix);
  if (!(modes.eigenvalues()[0] < 0.0)) return;
  matrix = modes.eigenvectors() * modes.eigenvalues().cwiseMax(0.0).asDiagonal() * modes.eigenvectors().transpose();
}

}  // namespace sheetbend
