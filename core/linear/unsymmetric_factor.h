// LU of an unsymmetric matrix, three rows and columns per particle, whose pattern is that of a symmetric one: what an implicit block with sliding contacts
// solves with (core/blocks/unsymmetric_supernodes.h).
#pragma once

#include <vector>

#include "core/blocks/unsymmetric_supernodes.h"
#include "core/linear/symmetric_factor.h"
#include "core/packs/kernels.h"

namespace sheetbend {

class UnsymmetricFactor {
 public:
  // s: by supernodes, with whole blocks of 3 x 3. The others below are given the same one.
  void resize(const FactorStructure& s);
  static std::size_t bytes(const FactorStructure& s);

  // Takes the values of a symmetric matrix, by FactorStructure::position.
  void load(const FactorStructure& s, const double* values);
  // Adds scale times a block (3, 3), row by row, to that of the rows and the columns of two particles, which begin at `row` and `column`.
  void add(const FactorStructure& s, int row, int column, double scale, const double* block);
  // Says whether every pivot has an inverse. `compiled` for this machine's instruction set where it is given, otherwise here.
  bool factorize(const FactorStructure& s, sheetbend_blocks::FactorUnsymmetric* compiled = nullptr);

  // b = A^-1 b or b = A^-T b; b may be over a larger scalar.
  template <class U>
  void solve(const FactorStructure& s, U* b) const {
    solve_with(s, b, [](const UnsymmetricSolve<U>& f) { f.solve(); });
  }
  template <class U>
  void solve_transposed(const FactorStructure& s, U* b) const {
    solve_with(s, b, [](const UnsymmetricSolve<U>& f) { f.solve_transposed(); });
  }

 private:
  template <class U, class F>
  void solve_with(const FactorStructure& s, U* b, F&& solve) const {
    thread_local std::vector<U> gathered;
    if (gathered.size() < s.longest()) gathered.resize(s.longest());
    solve(UnsymmetricSolve<U>{s.supernodes(), lower_.data(), upper_.data(), inverse_.data(), from_.data(), b,
                              gathered.data()});
  }

  std::vector<double> lower_, upper_, inverse_, work_;
  std::vector<int> from_, place_;
};

}  // namespace sheetbend
