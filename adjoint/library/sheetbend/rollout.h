/// @file
/// A motion and its derivatives.
#pragma once

#include <sheetbend/scene.h>
#include <sheetbend/solver.h>

#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace sheetbend::SHEETBEND_INLINE v0 {

/// Derivatives of one number with respect to everything that a motion or an equilibrium depends on.
struct SHEETBEND_API Gradient {
  Scene scene;
  std::vector<double> quantities;  ///< with respect to each quantity, in the order of Scene::quantities
  std::vector<double> inputs;      ///< with respect to each input, in the order of the flat inputs
  long recomputed = 0;             ///< substeps that were computed again, where the tape could not hold all states

  /// The derivative with respect to one quantity. @throws InputError  there is none of that name.
  double by(std::string_view quantity) const { return quantities[scene.quantity(quantity)]; }
  /// The derivatives with respect to one input array, such as "force". @throws InputError  there is none of that name.
  std::span<const double> by_array(std::string_view name) const {
    const Array a = scene.array(name);
    return std::span(inputs).subspan(a.offset, a.size);
  }
};

/// A motion from a scene's initial state: positions now, derivatives when asked. Its derivatives may be asked for any
/// number of times, and from several threads.
class SHEETBEND_API Rollout {
 public:
  /// Simulates, and keeps what a gradient needs.
  /// @param times   [s], ascending from 0 or later, on the grid of substeps; where positions are kept
  /// @param values  one for each quantity (Scene::values); the scene's own where they are left out
  /// @throws InputError  times off the grid, values that make no sense, a method that cannot step the scene, or a
  ///   budget that is too small.
  /// @throws DivergenceError, ConvergenceError
  Rollout(const Scene& scene, std::span<const double> times, const Solver& solver = {},
          std::span<const double> values = {});
  ~Rollout();
  Rollout(Rollout&&) noexcept;
  Rollout& operator=(Rollout&&) noexcept;

  std::span<const double> times() const;
  std::span<const double> positions() const;  ///< (frames, nodes, 3) [m], row by row

  /// The positions of one frame, (nodes, 3).
  std::span<const double> frame(std::size_t i) const;

  /// The gradient of a loss whose derivatives with respect to the positions are positions_bar (frames, nodes, 3):
  /// one reverse pass, whatever the number of inputs.
  /// @throws InputError  a wrong size, or numbers that are not finite.
  /// @throws DivergenceError  the gradient grew so much on its way back that rounding decides it.
  Gradient gradient(std::span<const double> positions_bar) const;

  /// How the positions (frames, nodes, 3) change when the values change by values_dot: one forward pass.
  std::vector<double> tangent(std::span<const double> values_dot) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Which rigid constraints of the first substep follow from others, in words; empty where none do. All methods but
/// `gauss_seidel` leave them out, and their multipliers are not unique.
SHEETBEND_API std::string redundant_constraints(const Scene& scene, const Solver& solver = {});

}  // namespace sheetbend::inline v0
