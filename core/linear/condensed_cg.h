// H^-1 by conjugate gradients. H = W^-1 + J^T D^-1 J is kept by blocks of two particles, and preconditioned on two levels: a forward sweep of
// Gauss-Seidel, what is left of the residual to aggregates as rigid bodies, a backward sweep (a symmetric V-cycle; Briggs, Henson & McCormick 2000).
#pragma once

#include <bit>
#include <vector>

#include "core/element/small_ldlt.h"
#include "core/linear/block_matrix.h"
#include "core/linear/coarse_level.h"
#include "core/linear/conjugate_gradients.h"

namespace sheetbend {

// The numbers of U as plain ones, in lanes. H is that of the values: what it has of the first order comes in by refinement (condensed.h).
template <class U>
using PlainLanes = std::conditional_t<is_plain<U>, U, Lanes<sizeof(U) / sizeof(double)>>;

struct CondensedIteration {
  Stopping stop;
  Aggregation aggregation;

  std::size_t bytes() const { return aggregation.bytes(); }
};

template <class T>
class CondensedCg {
 public:
  using Plain = decltype(coefficient<double>(T()));

  void prepare(const Aggregation& plan, const BlockNumbers<T>& block, const T* stiffness,
               typename Factor<Plain>::FactorSupernodes compiled) {
    fill(plan, block, stiffness);
    inverse_.resize(6 * static_cast<std::size_t>(block.movable));
    for (int i = 0; i < block.movable; ++i) invert(diagonal(plan, i), &inverse_[6 * static_cast<std::size_t>(i)]);
    coarse_.factorize(
        plan, blocks_.data(), [&](std::size_t i, int d) { return coefficient<double>(block.x[4 * i + d]); }, compiled);
  }

  // z = H^-1 z. `room` has work() numbers.
  template <class U>
  void solve(const CondensedIteration& plan, U* z, U* room) const {
    using V = PlainLanes<U>;
    const int particles = static_cast<int>(plan.aggregation.dof_of.size());
    const std::size_t size = 3 * static_cast<std::size_t>(particles);
    V *b = reinterpret_cast<V*>(room), *rest = b + 4 * size, *bodies = rest + size;
    for (std::size_t d = 0; d < size; ++d) b[d] = std::bit_cast<V>(z[d]);
    conjugate_gradients(Preconditioned<V>{matrix(plan.aggregation), plan.aggregation, coarse_, rest, bodies}, particles,
                        plan.stop, b, b + size);
    for (std::size_t d = 0; d < size; ++d) z[d] = std::bit_cast<U>(b[d]);
  }

  static std::size_t bytes(const Aggregation& plan) {
    return sizeof(Plain) * (9 * plan.column.size() + 6 * plan.dof_of.size()) + CoarseLevel<Plain>::bytes(plan);
  }
  static std::size_t work(const Aggregation& plan) {
    return 5 * 3 * plan.dof_of.size() + CoarseLevel<Plain>::work(plan);
  }

 private:
  template <class V>
  struct Preconditioned {
    BlockMatrix<Plain> H;
    const Aggregation& plan;
    const CoarseLevel<Plain>& coarse;
    V *rest, *bodies;

    void multiply(const V* p, V* q) const { H.multiply(p, q); }
    void precondition(const V* r, V* z) const {
      H.sweep_forward(r, z, rest);
      coarse.correct(plan, rest, z, bodies);
      H.sweep_backward(r, z, rest);
    }
  };

  void fill(const Aggregation& plan, const BlockNumbers<T>& block, const T* stiffness) {
    blocks_.assign(9 * plan.column.size(), Plain(0.0));
    const int* entry = plan.entry.data();
    plan.shares.template for_each<double>(block, stiffness, [&](int, int, const Plain* share) {
      Plain* to = &blocks_[9 * static_cast<std::size_t>(*entry++)];
      for (int e = 0; e < 9; ++e) to[e] += share[e];
    });
    for (int i = 0; i < block.movable; ++i)
      for (int a = 0; a < 9; a += 4) diagonal(plan, i)[a] += Plain(1.0) / coefficient<double>(block.inverse_mass(i));
  }

  Plain* diagonal(const Aggregation& plan, int i) {
    return &blocks_[9 * static_cast<std::size_t>(plan.start[i + 1] - 1)];
  }

  // The lower triangle of the inverse, column by column.
  static void invert(const Plain* block, Plain* inverse) {
    const SmallLdlt<3, Plain> factor(block);
    for (int a = 0; a < 3; ++a) {
      Plain column[3] = {Plain(0.0), Plain(0.0), Plain(0.0)};
      column[a] = Plain(1.0);
      factor.solve(column);
      inverse = std::copy(column + a, column + 3, inverse);
    }
  }

  BlockMatrix<Plain> matrix(const Aggregation& plan) const {
    return {plan.start.data(), plan.column.data(), blocks_.data(), inverse_.data(),
            static_cast<int>(plan.dof_of.size())};
  }

  std::vector<Plain> blocks_, inverse_;
  CoarseLevel<Plain> coarse_;
};

}  // namespace sheetbend
