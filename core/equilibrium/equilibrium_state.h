// What the equilibrium solver works on: coordinates and multipliers with their residuals, the scales that these are measured by, and what is soft or
// left out for now.
#pragma once

#include <limits>
#include <vector>

#include "core/equilibrium/equilibrium.h"
#include "core/equilibrium/resting_modes.h"

namespace sheetbend {

inline constexpr double near_rest =
    1e-6;  // relative residual below which Newton may go to a saddle (it is left again afterwards)

bool finite(const std::vector<double>& v);

struct EquilibriumState {
  const Scene& scene;
  Inputs<const double> in;
  const EquilibriumOptions& options;
  std::vector<double> x, lambda, r_x, r_l, compliance, softened, soft;
  double size, edge, weight, total = 0.0;  // of the scene, of an edge  [m]; largest and summed external force  [N]
  std::vector<double> inflation;  // per volume, what changing the start's to its own takes by the first estimate  [J]
  double residual = 0.0, last_step = std::numeric_limits<double>::infinity();
  bool exact, falling = false;  // nothing is softened any more; a saddle was left, and the energy falls away from it
  std::vector<RedundantRow> left_out;
  RestingContacts<double> contacts;
  RestingModes modes;

  // Throws std::invalid_argument where a scene has no energy, a group may go slack, or the start is not finite.
  EquilibriumState(const Scene& scene, const double* inputs, const double* start_x, const double* start_lambda,
                   const EquilibriumOptions& options);

  // A scale of stiffness that is there before any multiplier: of the loads or, without loads, a part of the softest constraint's. A kept
  // volume loads the constraints of its surface; one that only holds the body in place is no measure of them.
  double force_stiffness() const;
  double first_pseudo_stiffness(Kkt& kkt) const;

  // A compliance for each group, always falling, at which its violated constraints hold no more than a part of the energy that
  // the loads can give: full stiffness would answer a rough start with forces that crumple it. A volume is a load itself: of the work that
  // it is estimated to take, it may hold all.
  void soften();
  double missing_volume(std::size_t v) const;

  // lambda = -C/alpha wherever something gives way: the forces of the shape as it is. A fabric that stiffens by powers of ten has no other
  // measure.
  void take_elastic_multipliers();

  // Rows that others say already have no multipliers of their own.
  void leave_out(std::vector<RedundantRow> rows);
  bool any_rigid() const;

  // Calls f(c, row) for each row of each constraint and volume c.
  template <class F>
  void for_each_row(F&& f) const {
    for (const Group& group : scene.groups)
      for (int i = 0; i < group.count * group.rows; ++i) f(group.first + i / group.rows, group.first_row + i);
    for (int v = 0; v < static_cast<int>(scene.volumes.size()); ++v) f(scene.constraints + v, scene.rows + v);
  }

  void evaluate(const std::vector<double>& at_x, const std::vector<double>& at_lambda);  // r_x and r_l
  // Lets contacts be decided anew, and takes the residual at (x, lambda), relative to the forces that cancel in it and, by |J|, to the scene's size.
  void measure();
  // A Newton step of no length counts near rest only: at a fold K is so stiff that every step is short. Without loads the residual at rest
  // is rounding relative to rounding.
  bool converged() const;
  // Whether nothing pulls or pushes: without loads, and no constraint violated. Then the multipliers are zero, and no force is left to measure
  // others by.
  bool find_unstressed();

  double energy() const;
};

}  // namespace sheetbend
