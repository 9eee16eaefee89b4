// How a scene is stepped: substep, integrator, partition into blocks, iterations.
#pragma once

namespace sheetbend {

enum class Integrator : int { bdf1, bdf2 };
// Blocks of one by color; connected sets by LDL^T of their constraints; or the same sets through their particles (condensed.h), factored or by
// conjugate gradients; or these solved until their forces balance (implicit_block.h).
enum class Partition : int { gauss_seidel, direct, newton, newton_cg, implicit };

struct SolverOptions {
  double h = 1e-3;  // substep [s]
  Integrator integrator = Integrator::bdf2;
  Partition partition = Partition::direct;
  int iterations = 2;              // of implicit: more Newton matrices than these are an error
  double force_tolerance = 1e-10;  // largest force that implicit leaves, of the largest there is
  double cg_tolerance = 1e-12;     // relative residual at which conjugate gradients stop
  int cg_iterations = 10000;       // more than these are an error
  int threads = 1;
  int grain = 256;  // blocks per thread below which a color is not split
};

// One backward difference formula: x_{n+1} - history(x) = eta v_{n+1}, history(y) = now y_n + before y_{n-1}.
// BDF1: (x - x_n)/h. BDF2: (3x - 4x_n + x_{n-1})/(2h), so eta = 2h/3. The projection sees only eta: a = alpha/eta^2, g = alpha beta/eta.
struct Bdf {
  double eta, now, before;
  double extrapolate_now, extrapolate_before;  // the velocity at n+1, extrapolated (for the size of quadratic drag)

  static Bdf first_order(double h) { return {h, 1.0, 0.0, 1.0, 0.0}; }
  static Bdf second_order(double h) { return {2.0 * h / 3.0, 4.0 / 3.0, -1.0 / 3.0, 2.0, -1.0}; }

  // Of a substep where nothing touches. The first one of BDF2 is BDF1.
  static Bdf at(const SolverOptions& o, int substep) {
    return o.integrator == Integrator::bdf1 || substep == 0 ? first_order(o.h) : second_order(o.h);
  }
};

}  // namespace sheetbend
