// H^-1 by conjugate gradients: H = W^-1 + J^T D^-1 J is applied from the gradients that stand in the block and never formed. The preconditioner is its
// diagonal of 3 x 3 blocks, one per particle.
#pragma once

#include <bit>
#include <vector>

#include "core/element/small_ldlt.h"
#include "core/solver/block_numbers.h"
#include "core/solver/conjugate_gradients.h"

namespace sheetbend {

// The numbers of U as plain ones, in lanes. H is that of the values: what it has of the first order comes in by refinement (condensed.h).
template <class U>
using PlainLanes = std::conditional_t<is_plain<U>, U, Lanes<sizeof(U) / sizeof(double)>>;

template <class T>
class CondensedCg {
 public:
  using Plain = decltype(coefficient<double>(T()));

  void prepare(const BlockNumbers<T>& block, const T* stiffness) {
    mass_.resize(block.movable);
    inverse_.resize(inverse_size * static_cast<std::size_t>(block.movable));
    for (int p = 0; p < block.movable; ++p) {
      mass_[p] = Plain(1.0) / coefficient<double>(block.inverse_mass(p));
      Plain H[9] = {mass_[p],   Plain(0.0), Plain(0.0), Plain(0.0), mass_[p],
                    Plain(0.0), Plain(0.0), Plain(0.0), mass_[p]};
      for (int k = block.window[p]; k < block.window[p + 1]; ++k)
        for (int a = 0; a < 3; ++a) {
          const Plain kG = coefficient<double>(stiffness[block.rows[k]]) * coefficient<double>(block.gradient(k)[a]);
          for (int b = 0; b <= a; ++b) H[3 * a + b] += kG * coefficient<double>(block.gradient(k)[b]);
        }
      const SmallLdlt<3, Plain> factor(H);
      Plain* inverse = &inverse_[inverse_size * static_cast<std::size_t>(p)];
      for (int a = 0; a < 3; ++a) {
        Plain column[3] = {Plain(0.0), Plain(0.0), Plain(0.0)};
        column[a] = Plain(1.0);
        factor.solve(column);
        inverse = std::copy(column + a, column + 3, inverse);
      }
    }
  }

  // z = H^-1 z. `room` has work() numbers.
  template <class U>
  void solve(const BlockNumbers<T>& block, const T* stiffness, const Stopping& stop, U* z, U* room) const {
    using V = PlainLanes<U>;
    const std::size_t size = 3 * static_cast<std::size_t>(block.movable);
    V *b = reinterpret_cast<V*>(room), *force = b + 4 * size;
    for (std::size_t d = 0; d < size; ++d) b[d] = std::bit_cast<V>(z[d]);
    conjugate_gradients(Matrix<V>{block, stiffness, mass_.data(), inverse_.data(), force}, block.movable, stop, b,
                        b + size);
    for (std::size_t d = 0; d < size; ++d) z[d] = std::bit_cast<U>(b[d]);
  }

  static std::size_t bytes(std::size_t movable) { return sizeof(Plain) * (1 + inverse_size) * movable; }
  static std::size_t work(std::size_t movable, std::size_t rows) { return 12 * movable + rows; }

 private:
  static constexpr int inverse_size = 6;  // numbers of a symmetric 3 x 3 matrix

  template <class V>
  struct Matrix {
    const BlockNumbers<T>& block;
    const T* stiffness;
    const Plain *mass, *inverse;
    V* force;  // per row

    void multiply(const V* p, V* q) const {
      std::fill_n(force, block.size, V(0.0));
      block.subtract_times(p, force);
      for (int row = 0; row < block.size; ++row) force[row] = -coefficient<V>(stiffness[row]) * force[row];
      block.transpose_times(force, q);
      for (int i = 0; i < block.movable; ++i)
        for (std::size_t d = 3 * static_cast<std::size_t>(i), end = d + 3; d < end; ++d) q[d] += mass[i] * p[d];
    }

    void precondition(int i, V* z) const {
      const Plain* M = inverse + inverse_size * static_cast<std::size_t>(i);
      const Vec3<V> r(z);
      z[0] = M[0] * r.x + M[1] * r.y + M[2] * r.z;
      z[1] = M[1] * r.x + M[3] * r.y + M[4] * r.z;
      z[2] = M[2] * r.x + M[4] * r.y + M[5] * r.z;
    }
  };

  std::vector<Plain> mass_, inverse_;  // of the particles, and of the preconditioner's blocks
};

}  // namespace sheetbend
