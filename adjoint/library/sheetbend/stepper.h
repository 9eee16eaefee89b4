/// @file
/// One substep after the other, for controllers: state in, driven positions in, state out.
#pragma once

#include <sheetbend/scene.h>
#include <sheetbend/solver.h>

#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace sheetbend::SHEETBEND_INLINE v0 {

/// All that the next substep begins with.
struct State {
  int substep = 0;
  std::vector<double> positions;          ///< (nodes, 3) [m]
  std::vector<double> positions_before;   ///< the same a substep earlier
  std::vector<double> velocities;         ///< (nodes, 3) [m/s]
  std::vector<double> velocities_before;  ///< the same a substep earlier
};

/// Steps a scene from its initial state. The same substeps as those of a Rollout, bit by bit, while its inputs are left
/// as they are.
///
/// Memory is taken when a stepper is made. With one thread a step takes none, and neither does `restore`, nor `save` to
/// a State that was saved to before.
class SHEETBEND_API Stepper {
 public:
  /// @param scene   stays alive for as long as the stepper
  /// @param solver  its `memory` has no meaning here: a stepper keeps no tape
  /// @param values  one for each quantity (Scene::values); the scene's own where they are left out
  /// @throws InputError  values that make no sense, or a method that cannot step the scene.
  explicit Stepper(const Scene& scene, const Solver& solver = {}, std::span<const double> values = {});
  ~Stepper();
  Stepper(Stepper&&) noexcept;
  Stepper& operator=(Stepper&&) noexcept;

  /// Goes one substep on. Driven particles follow the scene's own motion, or stay where they were put last.
  ///
  /// Only numbers that are not finite count as divergence: a Rollout also knows finite states that mean nothing, by the
  /// energy that was put in, which nobody knows of inputs that change.
  /// @throws DivergenceError, ConvergenceError  the state is then not to be used; restore another one.
  void step();
  /// The same with the driven particles at given places when the substep ends.
  /// @param driven  (driven particles, 3) [m], in the order of Scene::driven
  /// @throws InputError  a wrong size, or numbers that are not finite.
  void step(std::span<const double> driven);

  int substep() const;
  double time() const;                         ///< [s]
  std::span<const double> positions() const;   ///< (nodes, 3) [m]; until the next step
  std::span<const double> velocities() const;  ///< (nodes, 3) [m/s]; until the next step

  /// Numbers that may be written between steps, and act on all later ones: "force" (knots, loaded particles, 3) [N],
  /// "gravity" (3) [m/s^2], "wind" (knots, 3) [m/s], "pressure" (triangles) [Pa]. Between several knots in time values
  /// are interpolated as in a rollout.
  /// @throws InputError  another array, or one that the scene does not have.
  std::span<double> input(std::string_view array);

  void save(State& state) const;
  /// Goes on from a state that a stepper of the same scene saved; the same bits follow. What was written to `input`,
  /// and where driven particles were put last, stays.
  /// @throws InputError  sizes of another scene, or numbers that are not finite.
  void restore(const State& state);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace sheetbend::inline v0
