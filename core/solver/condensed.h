// The solve with A = J W J^T + D of a block whose constraints all give way, D = a/(1+g) > 0, through its particles:
//   A^-1 b = D^-1 (b - J H^-1 J^T D^-1 b),     H = W^-1 + J^T D^-1 J     (Woodbury)
// H is the Hessian of implicit Euler without the curvature of C: global Newton. A sheet has an eighth as many coordinates as scalar constraints, and its H
// a fraction of A's fill. H is factored, or solved with by conjugate gradients.
#pragma once

#include <algorithm>
#include <variant>
#include <vector>

#include "core/solver/condensed_cg.h"
#include "core/solver/condensed_factor.h"

namespace sheetbend {

// What a plan knows about H: its pattern where it is factored, or what conjugate gradients go by.
using Condensation = std::variant<CondensedPattern, CondensedIteration>;

template <class T>
class CondensedSolver {
 public:
  void prepare(const Condensation& plan, const BlockNumbers<T>& block, typename Factor<T>::FactorSupernodes compiled) {
    stiffness_.resize(block.size);
    for (int row = 0; row < block.size; ++row) stiffness_[row] = T(1.0) / block.diagonal[row];
    if (const auto* pattern = std::get_if<CondensedPattern>(&plan))
      factor_.factorize(*pattern, block, stiffness_.data(), compiled);
    else
      cg_.prepare(std::get<CondensedIteration>(plan).aggregation, block, stiffness_.data(),
                  is_plain<T> ? compiled : nullptr);
  }

  // b = A^-1 b, with the numbers that were prepared.
  template <class U>
  void solve(const Condensation& plan, const BlockNumbers<T>& block, U* b) const {
    const int rows = block.size;
    std::vector<U>& own = scratch<U>();
    own.resize(work(plan, block.movable, rows));
    U *y = own.data(), *rest = y + rows, *room = rest + rows;
    std::copy_n(b, rows, y);
    solve_once(plan, block, y, room);
    for (int k = 0; k < refinements(plan); ++k) {
      subtract_matrix_times(block, y, b, rest, room);
      solve_once(plan, block, rest, room);
      for (int i = 0; i < rows; ++i) y[i] = y[i] + rest[i];
    }
    std::copy_n(y, rows, b);
  }

  // Numbers that solve() works on.
  static std::size_t work(const Condensation& plan, std::size_t movable, std::size_t rows) {
    const auto* iteration = std::get_if<CondensedIteration>(&plan);
    return 3 * rows + 3 * movable +
           (iteration ? CondensedCg<T>::work(iteration->aggregation) : CondensedFactor<T>::work(movable));
  }

  // What it holds once it has solved.
  static std::size_t bytes(const Condensation& plan, std::size_t movable, std::size_t rows) {
    const auto* pattern = std::get_if<CondensedPattern>(&plan);
    return sizeof(T) * (rows + work(plan, movable, rows)) +
           (pattern ? Factor<T>::bytes(pattern->structure)
                    : CondensedCg<T>::bytes(std::get<CondensedIteration>(plan).aggregation));
  }

 private:
  // A step of iterative refinement against A itself takes back the digits that the difference costs when D is small. Conjugate gradients, whose H is
  // that of the values, need one before it that brings in the first order.
  static int refinements(const Condensation& plan) {
    return std::holds_alternative<CondensedPattern>(plan) || is_plain<T> ? 1 : 2;
  }

  // y = D^-1 (y - J H^-1 J^T D^-1 y)
  template <class U>
  void solve_once(const Condensation& plan, const BlockNumbers<T>& block, U* y, U* room) const {
    U *scaled = room, *z = scaled + block.size, *rest = z + 3 * static_cast<std::size_t>(block.movable);
    for (int i = 0; i < block.size; ++i) scaled[i] = stiffness_[i] * y[i];
    block.transpose_times(scaled, z);
    if (const auto* pattern = std::get_if<CondensedPattern>(&plan))
      factor_.solve(*pattern, z, rest);
    else
      cg_.solve(std::get<CondensedIteration>(plan), z, rest);
    block.subtract_times(z, y);
    for (int i = 0; i < block.size; ++i) y[i] = stiffness_[i] * y[i];
  }

  // rest = b - A y
  template <class U>
  static void subtract_matrix_times(const BlockNumbers<T>& block, const U* y, const U* b, U* rest, U* z) {
    block.transpose_times(y, z);
    for (int p = 0; p < block.movable; ++p)
      for (int d = 3 * p; d < 3 * p + 3; ++d) z[d] = block.inverse_mass(p) * z[d];
    for (int i = 0; i < block.size; ++i) rest[i] = b[i] - block.diagonal[i] * y[i];
    block.subtract_times(z, rest);
  }

  // No allocation once it has grown.
  template <class U>
  std::vector<U>& scratch() const {
    if constexpr (std::is_same_v<T, U>) {
      return scratch_;
    } else {
      thread_local std::vector<U> own;
      return own;
    }
  }

  CondensedFactor<T> factor_;
  CondensedCg<T> cg_;
  std::vector<T> stiffness_;  // D^-1
  mutable std::vector<T> scratch_;
};

}  // namespace sheetbend
