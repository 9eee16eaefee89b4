// How far cotangents grow on their way back. Those of positions by earlier positions have no unit: where they grow by more than 1/eps, a change of the
// last bit of the state changes the motion by its own size. The gradient of such a motion is that of rounding errors.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "core/solver/divergence.h"

namespace sheetbend {

template <class T>
class CotangentGrowth {
 public:
  static constexpr int every = 32;  // substeps between looks
  static constexpr double most = 1.0 / std::numeric_limits<double>::epsilon();

  // Cotangents (dofs) that the loss has at a state.
  void seed(const T* x_bar, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i)
      for (int lane = 0; lane < scenes_of<T>; ++lane)
        largest_[lane] = std::max(largest_[lane], std::abs(number_of(x_bar[i], lane)));
  }

  // Throws Diverged where those at `step` have grown beyond meaning.
  void look(int step, double t, const Scene& scene, const T* x_bar) const {
    for (int n = 0; n < scene.nodes(); ++n)
      for (int d = 0; d < scene.dim[n]; ++d)
        for (int lane = 0; lane < scenes_of<T>; ++lane) {
          const double grown = std::abs(number_of(x_bar[scene.first_dof[n] + d], lane));
          if (!(grown <= most * largest_[lane])) throw Diverged(step, n, t, seen(grown / largest_[lane]));
        }
  }

 private:
  static std::string seen(double growth) {
    const auto digits = growth < 1e300 ? static_cast<int>(std::log10(growth)) : 300;
    return "has a gradient that grew 1e" + std::to_string(digits) +
           " times from the frames that the loss looks at back to here, so that rounding errors decide it";
  }

  std::array<double, scenes_of<T>> largest_{};
};

}  // namespace sheetbend
