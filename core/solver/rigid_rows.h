// The rows of an implicit block that do not give way, with multipliers of their own: rigid constraints, and those so stiff that K would lose the digits of
// everything else. Newton's method has the coordinates and these multipliers as unknowns,
//
//   [K  J^T] [dx      ]    [R]        R = (x - x~)/w - J^T lambda - all other forces
//   [J   -D] [-dlambda] = -[c]        c = (C + g (C - C_r) + a lambda)/(1+g),  D = a/(1+g)
//
// K + J^T S^-1 J is factored in place of K, where S is as soft as K makes no difference to (the augmented Lagrangian of Hestenes 1969 and Powell 1969): it
// has the same pattern, and K need not be positive definite where rows hold. What S adds is taken back by passes on the rows' residual alone, each of
// which leaves about (S - D)/(J K^-1 J^T) of it.
//
// Rows that follow from others are left out, with multipliers of zero: those whose pivot in J W J^T is too small at the state that the substep starts from.
#pragma once

#include <cmath>
#include <vector>

#include "core/linear/symmetric_factor.h"
#include "core/scalar/numbers.h"
#include "core/solver/plan.h"

namespace sheetbend {

class RigidRows {
 public:
  // The numbers of the block: values of the runs, and references of damped rows.
  struct Given {
    const DirectBlock& block;
    std::vector<Numbers<double>>& values;
    Numbers<double>& C_r;
    const std::vector<double>&
        unit;  // per particle of the block: the length of a coordinate of one (IncrementalPotential)
  };

  std::vector<double> lambda;  // per row

  // Takes the members that do not give way out of `values`, judged at these coordinates and inverse masses (rows of four).
  void find(const Scene& scene, const Given& given, const double* at);
  bool empty() const { return members_.empty(); }
  int size() const { return static_cast<int>(D_.size()); }
  int row(int j) const { return rows_[j]; }                             // of the block
  int own_row(int row) const { return empty() ? -1 : own_rows_[row]; }  // of a row of the block, -1 where it gives way
  bool left_out(int j) const { return left_out_[j]; }
  bool moves(int j) const { return weight_[j] > 0.0; }  // whether anything of it can
  double value(int j) const { return C_[j]; }
  double steepness(const DirectBlock& block, int j) const;  // |J| of what can move

  // Decides at these coordinates which rows are left out.
  void leave_out(const Given& given, const double* at);
  // A row that is left out as a sum of the others, there: J W J^T c = J W J_row^T. Its residual less theirs is the contradiction.
  std::vector<double> as_sum(const Given& given, const double* at, int row);

  // C, J and c there.
  void evaluate(const Given& given, const double* at);
  double residual(int j) const { return c_[j]; }
  const std::vector<double>& residuals() const { return c_; }
  double weight(int j) const { return weight_[j]; }      // 1/(J W J^T + D) of where leave_out() was
  double steepest(int j) const { return steepest_[j]; }  // the largest number of its gradient, per length
  // Adds J^T lambda and the magnitudes of its terms, (particles, 4).
  void push(const DirectBlock& block, double* force, double* magnitude) const;
  // What to add to the multipliers so that the least is left of R, three numbers per movable particle, sum w |R - J^T lambda|^2, and of the residuals c of
  // the rows that give way, once J W J^T + D is factored where J is. The coordinates alone tell the multipliers -c/D of stiff rows with few digits.
  void factorize(const DirectBlock& block, const double* at);
  template <class U>
  std::vector<U> balance(const DirectBlock& block, const double* at, const U* R, const U* c) const {
    std::vector<U> b(Factor<double>::right_side(structure_), U(0.0));
    for (int j = 0; j < size(); ++j)
      if (D_[j] > 0.0 && !left_out_[j]) b[j] = U(0.0) - c[j];
    for_each_number(block, [&](int j, int dof, double J) {
      b[j] = b[j] + (J * at[sheetbend_blocks::row * (dof / 3) + 3]) * R[dof];
    });
    factor_.solve(structure_, b.data());
    b.resize(D_.size());
    return b;
  }

  // Chooses S from the stiffness of the particles without these rows, (particles, 4), and adds J^T S^-1 J - sum lambda Hess(C) to the members' matrices.
  void add_elements(const Given& given, double* at, const double* stiffness, std::vector<Numbers<double>>& elements);

  // to += J z of rows of four; from -= J^T S^-1 y, three numbers per movable particle.
  void multiply(const DirectBlock& block, const double* z, double* to) const;
  template <class U>
  void add_softened(const DirectBlock& block, const U* y, U* z) const {
    for_each_number(block, [&](int j, int dof, double J) { z[dof] += (J / S_[j]) * y[j]; });
  }

  // [z; mu] = [K J^T; J -D]^-1 [z; mu] with inverse(z) for K + J^T S^-1 J; transposed where inverse is. Ends where a pass moves no more than `little` of
  // mu, and returns the share that the last one moved.
  template <class U, class Inverse>
  double solve(const DirectBlock& block, U* z, U* mu, Inverse&& inverse, double little) const {
    constexpr int most_passes = 60;
    constexpr int parts = sizeof(U) / sizeof(double);  // NOLINT(bugprone-sizeof-expression): one of a double
    const int n = size();
    std::vector<U> g(mu, mu + n), dz(z, z + 3 * static_cast<std::size_t>(block.movable));
    for (int j = 0; j < n; ++j) {
      mu[j] = U(0.0);
      if (left_out_[j]) g[j] = U(0.0);
    }
    std::fill_n(z, dz.size(), U(0.0));
    double share = 1.0;
    for (int pass = 0; pass < most_passes; ++pass) {
      add_softened(block, g.data(), dz.data());
      inverse(dz.data());
      for (std::size_t i = 0; i < dz.size(); ++i) z[i] = z[i] + dz[i];
      for (int j = 0; j < n; ++j) g[j] = U(0.0) - g[j];
      for_each_number(block, [&](int j, int dof, double J) { g[j] = g[j] + J * dz[dof]; });
      // Every number that U carries is looked at by itself.
      std::vector<double> largest(parts, 0.0), moved(parts, 0.0);
      for (int j = 0; j < n; ++j) {
        const U d = (1.0 / S_[j]) * g[j];
        mu[j] = mu[j] + d;
        for (int k = 0; k < parts; ++k) {
          largest[k] = std::max(largest[k], steepest_[j] * std::abs(reinterpret_cast<const double*>(mu + j)[k]));
          moved[k] = std::max(moved[k], steepest_[j] * std::abs(reinterpret_cast<const double*>(&d)[k]));
        }
        g[j] = (D_[j] - S_[j]) * d;
      }
      share = 0.0;
      for (int k = 0; k < parts; ++k)
        if (moved[k] > 0.0) share = std::max(share, moved[k] / largest[k]);
      if (!(share > little)) break;
      std::fill(dz.begin(), dz.end(), U(0.0));
    }
    return share;
  }

 private:
  struct Member {
    int kind, run, place;  // of the block's runs
    int first, count;      // own rows
    std::size_t J;         // where its gradient begins, (count, dofs)
    int arity;
    bool damped;
  };
  static int particle(const DirectBlock& block, const Member& m, int k) {
    return block.runs[m.run].nodes[lane_at(m.place, m.arity, k)] / sheetbend_blocks::row;
  }
  // f(row, dof, J) over what can move and is not left out.
  template <class F>
  void for_each_number(const DirectBlock& block, F&& f) const {
    for (const Member& m : members_)
      for (int k = 0; k < m.arity; ++k) {
        const int p = particle(block, m, k);
        if (p >= block.movable) continue;
        for (int j = 0; j < m.count; ++j) {
          if (left_out_[m.first + j]) continue;
          const double* J = &J_[m.J + static_cast<std::size_t>(3 * (j * m.arity + k))];
          for (int d = 0; d < 3; ++d) f(m.first + j, 3 * p + d, J[d]);
        }
      }
  }
  void place_rows(const DirectBlock& block);
  std::vector<double> matrix(const DirectBlock& block, const double* at, int column) const;

  std::vector<Member> members_;
  std::vector<int> rows_, own_rows_;   // per row: that of the block, and back
  std::vector<char> left_out_;         // likewise, and all below
  std::vector<double> a_, g_, D_, S_;  // S: softened D
  std::vector<double> C_, c_, weight_, steepest_;
  std::vector<double> J_;
  struct Use {
    int row;
    std::size_t J;  // the three numbers of the row's gradient
  };
  std::vector<std::vector<Use>> uses_;  // per movable particle
  FactorStructure structure_{0, {}};
  Factor<double> factor_;  // of J W J^T + D
};

}  // namespace sheetbend
