// Static equilibrium of a scene: r_x = 0 and r_l = 0 of residual.h.
//
// Newton's method on coordinates and multipliers together (a link of any stiffness then turns freely), and where Newton's step
// is not trusted, one implicit step of pseudo-time, mu (x' - x) = r_x(x', lambda'), 0 = r_l(x', lambda'): the proximal point
// method, which descends the energy (pseudo-transient continuation: Kelley & Keyes 1998). A step is trusted where the Hessian
// K is positive definite and every further, simplified Newton step with the same factors is at most half of the one before
// (the natural monotonicity test: Deuflhard, Newton Methods for Nonlinear Problems); otherwise mu grows. Constraints that the
// start violates by far are softened at first, unless it is the solution of other inputs. Saddles are left along their lowest mode, toward a stable shape
// that is near. So a solution is stable wherever energy tells it from rounding; soft wires have several, and which one is found depends on the start (see
// branches.h).
//
// Contacts push and pull while Newton's method takes a step; between steps the law decides which of them are apart, stick or slide (an active set).
//
// Rigid rows that others say already have no multipliers of their own, and A no inverse: they are left out, as a direct block leaves them out.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/equilibrium/kkt.h"
#include "core/solver/interrupt.h"

namespace sheetbend {

struct EquilibriumOptions {
  int max_iterations = 500;      // evaluations of the Newton matrix
  double tolerance = 1e-12;      // of the relative residual, or of Newton's step relative to the scene's size
  double t0 = 0.0;               // time at which boundary and force are taken  [s]
  bool stable = true;            // false: go to the nearest equilibrium, saddle or not
  const double* held = nullptr;  // coordinates (dofs) that friction counts from; null: Quantity::position
};

struct Equilibrium {
  std::vector<double> x;  // (dofs), fixed nodes included; free directors are unit vectors across their axes
  // (multipliers), force = J^T lambda: minus the tension for a distance, minus the moment for an angle; then the
  // pressures in kept volumes
  std::vector<double> lambda;
  double energy = 0.0;  // of weight and forces (free nodes; zero at the origin) and elastic  [J]
  double residual = std::numeric_limits<double>::infinity();  // largest of |r_x| / force scale and |r_l| / (|J| size)
  int iterations = 0;                                         // evaluations of the Newton matrix
  int unstable_modes = -1;  // negative eigenvalues of the energy's Hessian (on the tangent space of rigid constraints)
  bool converged = false;
  double t0 = 0.0;
  double force_stiffness = 0.0;        // scale of stiffness where the multipliers give none  [N/m]
  std::vector<RedundantRow> left_out;  // rigid rows that others say already at x; their multipliers are zero
  std::vector<double> held;            // that friction counts from; empty: Quantity::position
  std::string message;                 // why not converged and what to do; empty otherwise
};

struct EquilibriumState;

class EquilibriumSolver {
 public:
  // The scene must outlive the solver.
  explicit EquilibriumSolver(const Scene& scene) : scene_(scene), kkt_(scene) {}

  // Starts at start_x (dofs; null: Quantity::position), with the fixed nodes moved to their places; start_lambda (multipliers) makes a warm start.
  // A result that did not converge says so, with a message. Throws std::invalid_argument where the start is not finite.
  Equilibrium solve(const double* inputs, const double* start_x = nullptr, const double* start_lambda = nullptr,
                    const EquilibriumOptions& options = {}, Interrupt* interrupt = nullptr);

  const Scene& scene() const { return scene_; }

 private:
  using State = EquilibriumState;
  bool step(State& s, double mu, const double* alpha, double share = 1.0);
  void assemble(State& s);
  void estimate_multipliers(State& s);
  struct Mode {
    double curvature = 0.0;         // N/m
    std::vector<double> direction;  // (dofs)
  };
  Mode lowest_mode(const State& s);
  bool damped_step(State& s, double& mu, bool guessed);
  bool leave_saddle(State& s, double& mu);

  void find_redundant_rows(State& s);

  const Scene& scene_;
  Kkt kkt_;
  std::optional<Plan> blocks_;  // of the constraints, for redundant rows
};

}  // namespace sheetbend
