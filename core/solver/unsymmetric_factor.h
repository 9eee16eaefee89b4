// LU of an unsymmetric matrix of 3 x 3 blocks, one block per particle and pair of particles, whose pattern is symmetric: what an implicit block with sliding
// contacts solves with. Rows are eliminated one after the other in the order of the particles' places. There is no pivoting among particles; within
// one, the three rows of its pivot go largest first, since a sliding contact may leave nothing on the diagonal.
#pragma once

#include <array>
#include <vector>

#include "core/solver/pivot_block.h"
#include "core/solver/symmetric_factor.h"

namespace sheetbend {

// Which blocks exist, with those that elimination fills in.
class UnsymmetricStructure {
 public:
  // pairs: of places (row >= column) whose block is not zero. symmetric: of the matrix of all dofs, three for each place, whose values are taken over.
  UnsymmetricStructure(int places, std::vector<std::pair<int, int>> pairs, const FactorStructure& symmetric);

  int size() const { return static_cast<int>(lower_start_.size()) - 1; }
  std::size_t blocks() const { return lower_.size(); }  // below the diagonal, as many as above
  std::size_t bytes() const;

 private:
  friend class UnsymmetricFactor;
  // Where a block of the matrix stands: below the diagonal, above it, and its numbers in the symmetric matrix.
  struct Entry {
    int place;  // of a diagonal block, -1 for any other
    int lower, upper;
    std::array<std::size_t, 9> from;
  };

  // Where a column stands among those of a row, in all of them.
  static int slot(const std::vector<int>& start, const std::vector<int>& columns, int row, int column);

  std::vector<int> lower_start_{0}, lower_, upper_start_,
      upper_;  // per row its columns before and after the diagonal, ascending
  std::vector<Entry> entries_;
};

class UnsymmetricFactor {
 public:
  void resize(const UnsymmetricStructure& s);
  static std::size_t bytes(const UnsymmetricStructure& s);

  // Takes the values of a symmetric matrix, by FactorStructure::position.
  void load(const UnsymmetricStructure& s, const double* values);
  // Adds scale times a block (3, 3), row by row, to that of two places.
  void add(const UnsymmetricStructure& s, int row, int column, double scale, const double* block);
  // Says whether every pivot has an inverse.
  bool factorize(const UnsymmetricStructure& s);

  // b = A^-1 b or b = A^-T b, three numbers per place; b may be over a larger scalar.
  template <class U>
  void solve(const UnsymmetricStructure& s, U* b) const {
    for (int i = 0; i < s.size(); ++i)
      for (int k = s.lower_start_[i]; k < s.lower_start_[i + 1]; ++k)
        subtract(&lower_[9 * k], b + 3 * s.lower_[k], b + 3 * i);
    for (int i = s.size(); i-- > 0;) {
      for (int k = s.upper_start_[i]; k < s.upper_start_[i + 1]; ++k)
        subtract(&upper_[9 * k], b + 3 * s.upper_[k], b + 3 * i);
      pivots_[i].solve(b + 3 * i);
    }
  }
  template <class U>
  void solve_transposed(const UnsymmetricStructure& s, U* b) const {
    for (int i = 0; i < s.size(); ++i) {
      pivots_[i].solve_transposed(b + 3 * i);
      for (int k = s.upper_start_[i]; k < s.upper_start_[i + 1]; ++k)
        subtract_transposed(&upper_[9 * k], b + 3 * i, b + 3 * s.upper_[k]);
    }
    for (int i = s.size(); i-- > 0;)
      for (int k = s.lower_start_[i]; k < s.lower_start_[i + 1]; ++k)
        subtract_transposed(&lower_[9 * k], b + 3 * i, b + 3 * s.lower_[k]);
  }

 private:
  template <class U>
  static void subtract(const double* M, const U* from, U* to) {
    for (int a = 0; a < 3; ++a) to[a] -= M[3 * a] * from[0] + M[3 * a + 1] * from[1] + M[3 * a + 2] * from[2];
  }
  template <class U>
  static void subtract_transposed(const double* M, const U* from, U* to) {
    for (int a = 0; a < 3; ++a) to[a] -= M[a] * from[0] + M[3 + a] * from[1] + M[6 + a] * from[2];
  }
  std::vector<double> lower_, upper_;  // L with a unit diagonal, and U above its diagonal
  std::vector<PivotBlock> pivots_;     // U's diagonal
  std::vector<double*> place_;         // of a column in the row that is being made
};

}  // namespace sheetbend
