// Steps of the coordinates of a block, which stand in rows of four, and products of their three numbers per movable particle.
#pragma once

#include <vector>

#include "core/blocks/kernels.h"
#include "core/scalar/numbers.h"

namespace sheetbend {

// Sets `to` to the rows `from` plus t d on the movable particles.
inline void move(Numbers<double>& from, double t, const std::vector<double>& d, Numbers<double>& to) {
  to = from;
  double* x = to.data();
  for (std::size_t i = 0, p = 0; i < d.size(); i += 3, p += sheetbend_blocks::row)
    for (int k = 0; k < 3; ++k) x[p + k] += t * d[i + k];
}

inline double product(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace sheetbend
