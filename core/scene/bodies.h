// A body is four nodes: its center of mass p and three axes a1, a2, a3, nodes without unit of length. The material point X of the body is at
//
//   y(X) = p + X1 a1 + X2 a2 + X3 a3,
//
// the mass of p is the body's, that of a_k is J_k = integral rho X_k^2 dV = (I1 + I2 + I3)/2 - I_k  [kg m^2] in principal axes, so that the kinetic energy of
// the four nodes is the body's, gyroscopic forces included (Betsch & Steinmann 2001; Krenk & Nielsen 2014). A constraint `rigid` keeps the axes
// orthonormal. Axes have inertia and no weight: gravity does not act on them. A linear drag kappa on all three is a rotational drag of 2 kappa [N m s];
// a force f at X is f on p and X_k f [N m] on a_k.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace sheetbend {

// A body that keeps its spin has its angular momentum about the center [kg m^2/s] in the coordinates of a pinned node (core/step/keep_spin.h).
struct Body {
  int center;
  std::array<int, 3> axes;
  int spin = -1;
};

// Twice the largest radius of gyration of the bodies, which scenes count to their size [m]; 0 without bodies.
template <class Mass>
double width_of_bodies(const std::vector<Body>& bodies, const Mass& mass) {
  double width2 = 0.0;
  for (const Body& b : bodies)
    if (const double m = mass[b.center]; m > 0.0)
      width2 = std::max(width2, (mass[b.axes[0]] + mass[b.axes[1]] + mass[b.axes[2]]) / m);
  return 2.0 * std::sqrt(width2);
}

}  // namespace sheetbend
