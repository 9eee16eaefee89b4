// Steps of Newton's method by BiCGSTAB instead of a factor, where that is less work: for cloth in short substeps, whose inertia is not much less than its
// stiffness. The preconditioner is the inverse of each particle's own 3 x 3 block. Stiff contacts are part of it, so that they cost no iterations.
#pragma once

#include <vector>

#include "core/linear/bicgstab.h"
#include "core/solver/plan.h"

namespace sheetbend {

class NewtonIteration {
 public:
  // Whether a block has contacts, all of them of single particles, and neither frames nor self-contact. Others are always factored.
  static bool serves(const DirectBlock& block);
  void resize(const Scene& scene, const DirectBlock& block);
  static std::size_t bytes(const DirectBlock& block);

  // Takes the particles' own blocks of a matrix: masses, elements (per run, as in NewtonMatrix) and contacts (3, 3).
  void find(const Scene& scene, const DirectBlock& block, const std::vector<double>& masses,
            std::vector<Numbers<double>>& elements, const std::vector<double>& contacts);
  // Whether solving to this tolerance is expected to be less work than a factor, with a margin of two.
  bool pays(double tolerance) const { return 2.0 * expected(tolerance) <= most_; }

  // z = K^-1 z or K^-T z to the tolerance, three numbers per movable particle; multiply(p, q) is q = K p or K^T p. False, with z as it was, where it takes
  // more work than a factor.
  template <class Multiply>
  bool solve(double tolerance, bool transposed, Multiply&& multiply, double* z) {
    for (std::size_t p = 0; p < particles_; ++p) std::copy_n(z + 3 * p, 3, &krylov_.b[row * p]);
    struct {
      const NewtonIteration& own;
      const Multiply& product;
      bool transposed;
      void multiply(Numbers<double>& p, Numbers<double>& q) const { product(p, q); }
      void precondition(const double* r, double* y) const { own.precondition(transposed, r, y); }
    } const matrix{*this, multiply, transposed};
    if (!krylov_.solve(matrix, tolerance, static_cast<int>(most_))) return false;
    for (std::size_t p = 0; p < particles_; ++p) std::copy_n(&krylov_.x[row * p], 3, z + 3 * p);
    return true;
  }

 private:
  static constexpr std::size_t row = sheetbend_blocks::row;
  double expected(double tolerance) const;
  void precondition(bool transposed, const double* r, double* y) const;

  Bicgstab krylov_;
  std::vector<double> own_;      // per particle: its block (3, 3) of the matrix
  std::vector<double> inverse_;  // likewise, in three columns of four numbers
  std::size_t particles_ = 0;
  double most_ = 0.0;   // iterations that are as much work as a factor
  double ratio_ = 0.0;  // of stiffness to inertia, the largest
};

}  // namespace sheetbend
