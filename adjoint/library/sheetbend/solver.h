/// @file
/// How a scene is stepped.
#pragma once

#include <sheetbend/export.h>

#include <cstddef>
#include <limits>

namespace sheetbend::SHEETBEND_INLINE v0 {

enum class Integrator {
  bdf1,  ///< backward Euler, first order: damps like zeta = omega h/2
  bdf2,  ///< second order
};

/// How the constraints of a substep are solved; see `sheetbend.Solver` of the Python package.
enum class Method {
  direct,        ///< each connected part by its constraints: for ropes
  newton,        ///< the same parts by their particles: for cloth; each rigid row costs a solve more
  newton_cg,     ///< the same by conjugate gradients: for cloth of more than some 20,000 vertices
  implicit,      ///< each substep iterated until its forces balance: for contacts
  gauss_seidel,  ///< colored sweeps
};

/// Substep, method and limits.
struct Solver {
  double h = 1e-3;  ///< substep [s]
  Integrator integrator = Integrator::bdf2;
  Method method = Method::direct;
  int iterations = 0;              ///< 0: 2, of gauss_seidel 10 (sweeps), of implicit 100 (the most)
  int threads = 1;                 ///< results do not depend on it
  int grain = 256;                 ///< constraints per thread below which a color is not split
  double force_tolerance = 1e-10;  ///< what implicit may leave of the largest force
  double cg_tolerance = 1e-12;     ///< relative residual at which conjugate gradients stop
  int cg_iterations = 10000;       ///< more are an error
  /// Bytes that a gradient may take; what does not fit on its tape is computed again, with the same result.
  std::size_t memory = std::numeric_limits<std::size_t>::max();
};

}  // namespace sheetbend::inline v0
