/// @file
/// What a recording shows of a scene.
#pragma once

#include <sheetbend/export.h>

#include <array>
#include <vector>

namespace sheetbend::SHEETBEND_INLINE v0 {

/// A point of the scene that a recording shows: the weighted sum of up to four particles.
struct Marker {
  std::array<int, 4> particles;
  std::array<double, 4> weights;

  /// On a particle.
  static Marker on(int particle) { return {{particle, particle, particle, particle}, {1.0, 0.0, 0.0, 0.0}}; }
  /// On the line through two particles, `fraction` of the way.
  static Marker between(int first, int second, double fraction) {
    return {{first, second, second, second}, {1.0 - fraction, fraction, 0.0, 0.0}};
  }
};

/// Robust losses of a marker's distance, in units of sigma times loss_scale: squares, Huber's loss (1964), and its
/// smooth form soft L1. They count marker by marker, where a ceres::LossFunction counts a residual block as a whole.
enum class Loss { squares, soft_l1, huber };

/// A recording of markers.
struct Observations {
  std::vector<double> times;      ///< (frames) [s], ascending; on the scene's clock from 0 on, off the substeps too
  std::vector<Marker> markers;    ///< where they sit on the scene
  std::vector<double> positions;  ///< (frames, markers, 3) [m], row by row; three NaN where a marker was not seen
  double sigma = 1e-3;            ///< expected error of a marker [m], by which residuals are divided
  Loss loss = Loss::squares;
  double loss_scale = 1.0;
  bool at_rest = false;         ///< the one frame shows an equilibrium
  bool starts_at_rest = false;  ///< the motion starts from the scene's equilibrium
};

}  // namespace sheetbend::inline v0
