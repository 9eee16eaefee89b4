// The Newton matrix of static equilibrium,  A = [H - mu, J^T; J, alpha]  with H = sum_j lambda_j Hess(C_j) + p Hess(V), and the
// solution of A z = b. Rows are those of the constraints and one per kept volume.
//
// It is condensed onto the free coordinates: K = mu - H + J^T alpha^-1 J is the Hessian of the energy (plus mu), narrow for a
// chain and positive definite at a stable equilibrium, so LDL^T in a low-fill order suffices. Rigid and nearly rigid rows are
// condensed with a small compliance of their own, and the solution is refined against A itself, which also removes the rounding
// of stiff rows (the augmented Lagrangian step for saddle point systems: Benzi, Golub & Liesen 2005). The row of a kept volume touches all its
// vertices, so it stays beside K, last in the order:  [K, -g; -g^T, -alpha].
//
// Directors may grow and lean along their axis, normals may grow, without changing any constraint. K gets a stiffness of its own in these directions, in
// which nothing pushes, so that it is regular.
//
// Contacts that slide make K unsymmetric. Then it has an LU factorization besides, and the pivots are those of its symmetric part.
//
// Negative pivots, less one per kept volume, count the unstable modes (Sylvester's law of inertia); in the limit of rigid rows K has one positive
// eigenvalue per row and those of the energy's Hessian on the rows' tangent space (Gould 1985).
#pragma once

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <Eigen/SparseLU>
#include <array>
#include <memory>
#include <vector>

#include "core/equilibrium/resting_modes.h"
#include "core/rollout/redundant_rows.h"
#include "core/scene/scene.h"

namespace sheetbend {

// The largest |entry|.
double largest(const std::vector<double>& v);

class Kkt {
 public:
  // Finds the pattern and the elimination order; the scene must outlive this.
  explicit Kkt(const Scene& scene);

  // Evaluates H and J at x (dofs) and lambda (multipliers). force_stiffness [N/m], a typical force over a typical length, is the scale
  // of stiffness where the multipliers give none. Rows that are left out have no gradient: with a right side of zero their multiplier stays.
  void assemble(const double* inputs, const double* x, const double* lambda, double force_stiffness,
                const std::vector<RedundantRow>& left_out);

  // The contacts' share, one block for each free point of each contact, in the scene's order.
  void take_contacts(std::vector<ContactBlock> blocks);

  // Factors K for mu >= 0 [N/m] and the compliance of each constraint and volume. False where K is singular to rounding.
  bool factorize(double mu, const double* compliance);
  int negative_modes() const { return negative_; }
  double largest_diagonal() const { return largest_diagonal_; }
  // What mu is multiplied by at a coordinate: 1, of a director the square of its edge's length, of an axis that of its body's
  // radius of gyration.
  double metric(int dof) const { return metric_[dof]; }

  // Solves A (x, lambda) = (x, lambda) in place; entries of fixed nodes come out zero. Refines until corrections are below `accuracy`
  // relative to the solution or stop shrinking; false if that leaves more than 1e-6.
  bool solve(double* x, double* lambda, double accuracy = 1e-13, bool transposed = false) const;

 private:
  using Factor = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Upper, Eigen::NaturalOrdering<int>>;

  // kkt_pattern.cpp
  template <class F>
  void for_each_pair(const std::vector<int>& number, F&& f) const;
  std::vector<Eigen::Triplet<double>> order_unknowns();
  void set_pattern(std::vector<Eigen::Triplet<double>> upper);
  void find_positions();

  void press(const Inputs<const double>& in, const double* x, const double* lambda, double* H);
  void measure_idle(const Inputs<const double>& in, const double* x);
  void add_geometric_stiffness();
  void add_elastic_stiffness();
  void hold_idle();
  void condensed_solve(const std::vector<double>& b_x, const std::vector<double>& b_l, bool transposed,
                       std::vector<double>& x, std::vector<double>& lambda) const;
  bool factorize_whole();
  template <class F>
  void for_each_contact_entry(F&& f) const;
  template <class F>
  void for_each_border(F&& f) const;
  void subtract_product(const std::vector<double>& x, const std::vector<double>& lambda, bool transposed,
                        std::vector<double>& r_x, std::vector<double>& r_l) const;

  const Scene& scene_;
  int free_ = 0;                             // unknowns that are coordinates; one per volume follows
  std::vector<int> unknown_;                 // per dof: place in K, or -1
  std::vector<int> position_;                // of H_'s entries in K's values, -1 where fixed or below the diagonal
  std::vector<int> diagonal_;                // likewise, per unknown
  std::vector<std::array<int, 3>> pressed_;  // triangles in air, then those of the volumes
  std::vector<std::vector<int>> border_position_;  // per volume, of its nodes' coordinates; -1 where fixed
  std::vector<double> H_;                          // dofs x dofs per constraint, then 9 x 9 per pressed triangle
  std::vector<std::vector<double>> border_;        // per volume its gradient, at its nodes' coordinates
  std::vector<double> J_, alpha_, softened_;
  std::vector<double> metric_;               // per dof
  std::vector<int> director_position_;       // into K's values, 9 per director, -1 as in position_
  std::vector<std::array<double, 9>> idle_;  // per director: projection onto the directions that nothing depends on
  std::vector<double> idle_stiffness_;       // per director
  std::vector<ContactBlock> contacts_;
  bool slides_ = false;
  struct PointDofs {
    int count, first[most_point_nodes];  // per node
  };
  std::vector<PointDofs> contact_dofs_;  // per block
  std::vector<int> contact_position_;    // of the blocks' entries in K's values, -1 as in position_
  double mu_ = 0.0, force_stiffness_ = 0.0, geometric_ = 0.0, largest_diagonal_ = 0.0;
  int negative_ = 0;
  Eigen::SparseMatrix<double> K_;
  Factor factor_;
  std::unique_ptr<Eigen::SparseLU<Eigen::SparseMatrix<double>>> whole_;  // of K with what slides
};

// Calls f(block, entry, weights, row, column) for the 9 entries of each pair of nodes of each contact's point, rows and columns being dofs.
template <class F>
void Kkt::for_each_contact_entry(F&& f) const {
  for (std::size_t i = 0; i < contact_dofs_.size(); ++i) {
    const PointDofs& p = contact_dofs_[i];
    for (int k = 0; k < p.count; ++k)
      for (int l = 0; l < p.count; ++l) {
        const double weights = contacts_.empty() ? 1.0 : contacts_[i].weight[k] * contacts_[i].weight[l];
        for (int e = 0; e < 9; ++e) f(i, e, weights, p.first[k] + e / 3, p.first[l] + e % 3);
      }
  }
}

// Calls f(volume, place in its gradient, dof).
template <class F>
void Kkt::for_each_border(F&& f) const {
  for (int v = 0; v < static_cast<int>(scene_.volumes.size()); ++v) {
    const std::vector<int>& nodes = scene_.volumes[v].nodes;
    for (std::size_t i = 0; i < 3 * nodes.size(); ++i)
      f(v, i, scene_.first_dof[nodes[i / 3]] + static_cast<int>(i % 3));
  }
}

}  // namespace sheetbend
