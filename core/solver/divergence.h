// Divergence: a state that is not finite, or one that nothing put into the rollout explains.
//
// With substeps that are far too long, solvers leave a state that is finite and means nothing: a pinned cloth hundreds of meters away, or shrunk to a
// point. Three finite states count as diverged. With E the energy put into the scene (kinetic and elastic energy at the start, work of gravity, loads,
// air and given motion, each estimated from above):
//
//   fast:       the kinetic energy is above 1e4 E
//   stretched:  stencils of constraints are more than twice as wide as at the start, beyond what given motion explains, and their elastic energy is
//               above 1e3 E
//   shrunk:     more than half of all stencils are below a hundredth of their width at the start, and their elastic energy is above 10 E
//
// Margins are wide because a false alarm would end a sound simulation: energy is kept or lost in all that the solver approximates, so a sound motion
// stays below 1 where these ask for 10 to 10,000. Width and energy are asked for together, because sweeps that have not converged leave a stiff
// constraint stretched by more than its own stiffness allows, and soft springs may be stretched to many times their length.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/scalar/pack.h"
#include "core/solver/plan.h"
#include "core/solver/scenes.h"

namespace sheetbend {

// What was seen at a node, in words that follow "particle 3": "is not finite".
struct Finding {
  int node;
  std::string seen;
};

inline constexpr const char* not_finite = "is not finite";

struct Diverged : std::runtime_error {
  int substep, node;
  double time;
  std::string seen;
  Diverged(int substep, int node, double time, const std::string& seen = not_finite);
};

// The state of one scene, against the one that it started from; (dofs), (dofs), (dofs) and (nodes) numbers.
struct Moved {
  const double *start, *x, *v, *mass;
};

// Looks at the states of one rollout. `suspects` is cheap; `find` needs all inputs and evaluates every constraint.
class StateCheck {
 public:
  StateCheck(const Scene& scene, const SolverOptions& options, double t0) : scene_(scene), options_(options), t0_(t0) {}

  bool suspects(const Moved& state) const;
  // What is wrong at time t, if anything. What was found to be in order is not suspected again until it grows.
  std::optional<Finding> find(const Moved& state, const Inputs<const double>& in, double t);

 private:
  const Scene& scene_;
  const SolverOptions& options_;
  double t0_;
  double kinetic_ = 0.0, widening_ = 0.0;  // the largest that were in order
};

// Looks at every lane of a rollout now and then; it neither changes nor keeps anything of the rollout.
template <class T>
class Watch {
 public:
  static constexpr int every = 32;  // substeps between looks, which cost less than one substep each

  Watch(const Scene& scene, const SolverOptions& options, const Inputs<const T>& in, double t0, const T* start)
      : scene_(scene),
        in_(in),
        start_(start, start + scene.dofs()),
        checks_(scenes_of<T>, StateCheck(scene, options, t0)) {}

  // Throws Diverged.
  void look(int step, double t, const T* x, const T* v) {
    for (int lane = 0; lane < scenes_of<T>; ++lane) {
      const std::vector<double> start = lane_of(start_.data(), start_.size(), lane),
                                xs = lane_of(x, start.size(), lane), vs = lane_of(v, start.size(), lane),
                                mass = lane_of(in_.of(Quantity::mass), scene_.nodes(), lane);
      const Moved state{start.data(), xs.data(), vs.data(), mass.data()};
      if (!checks_[lane].suspects(state)) continue;
      const std::vector<double> inputs = lane_of(in_.data, scene_.layout.total(), lane);
      if (const auto found = checks_[lane].find(state, {scene_.layout, inputs.data()}, t))
        throw Diverged(step, found->node, t, found->seen);
    }
  }

 private:
  static std::vector<double> lane_of(const T* from, std::size_t size, int lane) {
    std::vector<double> to(size);
    for (std::size_t i = 0; i < size; ++i) to[i] = number_of(from[i], lane);
    return to;
  }

  const Scene& scene_;
  const Inputs<const T>& in_;
  std::vector<T> start_;
  std::vector<StateCheck> checks_;
};

}  // namespace sheetbend
