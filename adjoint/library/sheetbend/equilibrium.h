/// @file
/// The state in which a scene rests, and its derivatives.
#pragma once

#include <sheetbend/rollout.h>

#include <memory>
#include <span>
#include <vector>

namespace sheetbend::SHEETBEND_INLINE v0 {

/// A static equilibrium, stable wherever the start allows, of the scene at time 0.
class SHEETBEND_API Equilibrium {
 public:
  /// @param values  one for each quantity; the scene's own where they are left out
  /// @param start   (nodes, 3) [m]; the scene's initial positions where they are left out
  /// @throws InputError  values that make no sense, wrong sizes.
  /// @throws ConvergenceError  none was found.
  explicit Equilibrium(const Scene& scene, std::span<const double> values = {}, std::span<const double> start = {});
  ~Equilibrium();
  Equilibrium(Equilibrium&&) noexcept;
  Equilibrium& operator=(Equilibrium&&) noexcept;

  std::span<const double> positions() const;  ///< (nodes, 3) [m]
  double energy() const;                      ///< elastic, and of weight and forces [J]
  int unstable_modes() const;                 ///< negative eigenvalues of the energy's Hessian; 0 where it is stable

  /// The gradient of a loss whose derivatives with respect to the positions are positions_bar (particles, 3), found
  /// with the implicit function theorem. @throws ConvergenceError  at a fold, or where a part moves freely.
  Gradient gradient(std::span<const double> positions_bar) const;

  /// How the positions (particles, 3) change when the values change by values_dot.
  std::vector<double> tangent(std::span<const double> values_dot) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace sheetbend::inline v0
