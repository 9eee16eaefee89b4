// A direct block's numbers at one iteration, and products with its J, by particles: no list of couplings is needed.
#pragma once

#include <type_traits>

#include "core/blocks/kernels.h"
#include "core/scalar/dual.h"
#include "core/scalar/pack.h"
#include "core/scalar/vec3.h"

namespace sheetbend {

// A plain number is one (or one per lane); others carry a first order beside it (duals, complex steps).
template <class T>
inline constexpr bool is_plain = std::is_same_v<T, double> || std::is_same_v<T, Pack>;

// A number as a coefficient of U: where U are plain numbers it is its value alone.
template <class U, class T>
auto coefficient(const T& a) {
  if constexpr (is_plain<T> || std::is_same_v<T, U>)
    return a;
  else
    return value_of(a);
}

// Whether a row with this D does not give way, of one lane at least.
template <class T>
bool is_rigid(const T& D) {
  if constexpr (std::is_same_v<T, Pack>) {
    for (int lane = 0; lane < Pack::lanes; ++lane)
      if (D[lane] == 0.0) return true;
    return false;
  } else {
    return value_of(D) == 0.0;
  }
}

template <class T>
struct BlockNumbers {
  const T *gradients,
      *x;  // rows of four: gradients in the order of the window; coordinates of the particles with their inverse masses
  const T* diagonal;         // D = a/(1+g), per row
  const int *window, *rows;  // as in sheetbend_blocks::Block
  int movable, size;
  int volumes = 0;  // rows of kept volumes, the last of `size`

  T inverse_mass(int particle) const { return x[sheetbend_blocks::row * static_cast<long>(particle) + 3]; }

  // z = J^T y. Coordinates are three per movable particle.
  template <class U>
  void transpose_times(const U* y, U* z) const {
    for (int p = 0; p < movable; ++p) {
      U sum[3] = {U(0.0), U(0.0), U(0.0)};
      for (int k = window[p]; k < window[p + 1]; ++k) {
        const T* G = gradient(k);
        for (int d = 0; d < 3; ++d) sum[d] += coefficient<U>(G[d]) * y[rows[k]];
      }
      for (int d = 0; d < 3; ++d) z[3 * p + d] = sum[d];
    }
  }

  // b -= J z.
  template <class U>
  void subtract_times(const U* z, U* b) const {
    for (int p = 0; p < movable; ++p) {
      const Vec3<U> own(z + 3 * static_cast<long>(p));
      for (int k = window[p]; k < window[p + 1]; ++k) {
        const T* G = gradient(k);
        b[rows[k]] -= coefficient<U>(G[0]) * own.x + coefficient<U>(G[1]) * own.y + coefficient<U>(G[2]) * own.z;
      }
    }
  }

  const T* gradient(int k) const { return gradients + sheetbend_blocks::row * static_cast<long>(k); }
};

}  // namespace sheetbend
