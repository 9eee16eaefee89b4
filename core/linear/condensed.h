// The solve with A = J W J^T + D of a block whose constraints give way, D = a/(1+g) > 0, through its particles:
//   A^-1 b = D^-1 (b - J H^-1 J^T D^-1 b),     H = W^-1 + J^T D^-1 J     (Woodbury)
// H is the Hessian of implicit Euler without the curvature of C: global Newton. A sheet has an eighth as many coordinates as scalar constraints, and its H
// a fraction of A's fill. H is factored, or solved with by conjugate gradients.
//
// The rows g of rigid constraints have no D^-1, and those of kept volumes would fill H: they stay beside it, as its border. From z = H^-1 J^T D^-1 b of the
// other rows alone their part of the solution is p = S^-1 (b_p - g^T z), S = D + g^T H^-1 g, which adds H^-1 g p to z. It costs a solve with H per row of
// the border: it is for a pole or a body in a cloth, not for chains of rigid links.
#pragma once

#include <algorithm>
#include <variant>
#include <vector>

#include "core/linear/condensed_cg.h"
#include "core/linear/condensed_factor.h"

namespace sheetbend {

// What a plan knows about H: its pattern where it is factored, or what conjugate gradients go by.
using Condensation = std::variant<CondensedPattern, CondensedIteration>;

template <class T>
class CondensedSolver {
 public:
  void prepare(const Condensation& plan, const BlockNumbers<T>& block, typename Factor<T>::FactorSupernodes compiled) {
    stiffness_.assign(block.size, T(0.0));
    border_.clear();
    for (int row = 0; row < block.size; ++row)
      if (row >= block.size - block.volumes || is_rigid(block.diagonal[row]))
        border_.push_back(row);
      else
        stiffness_[row] = T(1.0) / block.diagonal[row];
    if (const auto* pattern = std::get_if<CondensedPattern>(&plan))
      factor_.factorize(*pattern, block, stiffness_.data(), compiled);
    else
      cg_.prepare(std::get<CondensedIteration>(plan).aggregation, block, stiffness_.data(),
                  is_plain<T> ? compiled : nullptr);
    if (!border_.empty()) prepare_border(plan, block);
  }

  // b = A^-1 b, with the numbers that were prepared.
  template <class U>
  void solve(const Condensation& plan, const BlockNumbers<T>& block, U* b) const {
    const int rows = block.size;
    std::vector<U>& own = scratch<U>();
    own.resize(work(plan, block.movable, rows, border_.size()));
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
  static std::size_t work(const Condensation& plan, std::size_t movable, std::size_t rows, std::size_t border) {
    const auto* iteration = std::get_if<CondensedIteration>(&plan);
    return 3 * rows + 3 * movable + border +
           (iteration ? CondensedCg<T>::work(iteration->aggregation) : CondensedFactor<T>::work(movable));
  }

  // What it holds once it has solved; of a border that of volumes, since which constraints are rigid is not known before.
  static std::size_t bytes(const Condensation& plan, std::size_t movable, std::size_t rows, std::size_t volumes) {
    const auto* pattern = std::get_if<CondensedPattern>(&plan);
    return sizeof(T) * (rows + work(plan, movable, rows, volumes) + volumes * (6 * movable + volumes)) +
           sizeof(int) * volumes +
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
    U *scaled = room, *z = scaled + block.size, *p = z + 3 * static_cast<std::size_t>(block.movable);
    for (int i = 0; i < block.size; ++i) scaled[i] = stiffness_[i] * y[i];
    block.transpose_times(scaled, z);
    solve_particles(plan, z, p + border_.size());
    if (!border_.empty()) add_border(block, y, z, p);
    block.subtract_times(z, y);
    for (int i = 0; i < block.size; ++i) y[i] = stiffness_[i] * y[i];
    for (std::size_t v = 0; v < border_.size(); ++v) y[border_[v]] = p[v];
  }

  // z = H^-1 z
  template <class U>
  void solve_particles(const Condensation& plan, U* z, U* room) const {
    if (const auto* pattern = std::get_if<CondensedPattern>(&plan))
      factor_.solve(*pattern, z, room);
    else
      cg_.solve(std::get<CondensedIteration>(plan), z, room);
  }

  // g, H^-1 g and the factors of S.
  void prepare_border(const Condensation& plan, const BlockNumbers<T>& block) {
    const int count = static_cast<int>(border_.size());
    const std::size_t dofs = 3 * static_cast<std::size_t>(block.movable);
    gradients_.resize(count * dofs);
    schur_.resize(static_cast<std::size_t>(count) * count);
    std::vector<T>& own = scratch<T>();
    own.resize(work(plan, block.movable, block.size, count));
    for (int v = 0; v < count; ++v) {
      std::fill_n(own.data(), block.size, T(0.0));
      own[border_[v]] = T(1.0);
      block.transpose_times(own.data(), &gradients_[v * dofs]);
    }
    responses_ = gradients_;
    for (int v = 0; v < count; ++v) solve_particles(plan, &responses_[v * dofs], own.data());
    T* L = schur_.data();
    for (int v = 0; v < count; ++v)
      for (int w = 0; w <= v; ++w) {
        T sum = v == w ? block.diagonal[border_[v]] : T(0.0);
        for (std::size_t d = 0; d < dofs; ++d) sum += gradients_[v * dofs + d] * responses_[w * dofs + d];
        const T own = sum;
        for (int k = 0; k < w; ++k) sum -= L[v * count + k] * L[k * count + k] * L[w * count + k];
        L[v * count + w] =
            v == w ? select(sum > T(redundant_pivot) * own, sum, T(0.0)) : over_pivot(sum, L[w * count + w]);
      }
  }

  // p = S^-1 (b_p - g^T z), z += H^-1 g p
  template <class U>
  void add_border(const BlockNumbers<T>& block, const U* b, U* z, U* p) const {
    const int count = static_cast<int>(border_.size());
    const std::size_t dofs = 3 * static_cast<std::size_t>(block.movable);
    const T* L = schur_.data();
    for (int v = 0; v < count; ++v) {
      p[v] = b[border_[v]];
      for (std::size_t d = 0; d < dofs; ++d) p[v] -= gradients_[v * dofs + d] * z[d];
      for (int k = 0; k < v; ++k) p[v] -= L[v * count + k] * p[k];
    }
    for (int v = count; v-- > 0;) {
      p[v] = over_pivot(p[v], L[v * count + v]);
      for (int k = v + 1; k < count; ++k) p[v] -= L[k * count + v] * p[k];
    }
    for (int v = 0; v < count; ++v)
      for (std::size_t d = 0; d < dofs; ++d) z[d] += responses_[v * dofs + d] * p[v];
  }

  // a/pivot; zero in a row that others say already, whose pivot is zero (pivot.h).
  template <class U>
  static U over_pivot(const U& a, const T& pivot) {
    const T left_out = select(pivot > T(0.0), T(0.0), T(1.0));
    return ((T(1.0) - left_out) * a) / (pivot + left_out);
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
  std::vector<T> stiffness_;              // D^-1; zero in the rows of the border
  std::vector<int> border_;               // its rows, those of volumes last
  std::vector<T> gradients_, responses_;  // their g and H^-1 g, three numbers per movable particle
  std::vector<T> schur_;                  // (border, border) factors of S: L below the diagonal, the pivots on it
  mutable std::vector<T> scratch_;
};

}  // namespace sheetbend
