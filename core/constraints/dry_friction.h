// Dry friction: a torsion spring that slides. With e the angle from a set, the x of the stencil's last node,
//
//   C = e where |e| <= y,   C = sign(e) sqrt(y (2 |e| - y)) beyond   [rad],
//
// so the energy C^2/(2 alpha) is quadratic up to y and grows linearly from there (Huber 1964): the torque C dC/de / alpha is e/alpha while the
// joint sticks and y/alpha, the torque of Coulomb's friction, while it slides. The balance at the end of a substep decides which, so that the
// torque depends neither on the rate nor on the substep. The set then follows the angle at the distance y (yield.h): elastic and perfectly plastic,
// what Dahl's law (1968) becomes for its largest exponents.
// Compliance alpha in rad/(N m), the parameter `yield` is y: alpha = y/T for the torque T. A compliance of zero never slides and is refused at
// validation. Solvers that take a fixed number of iterations ask for a friction that stops nothing within a substep, h^2 T/inertia < y.
#pragma once

#include "core/constraints/concept.h"
#include "core/scalar/scalar.h"

namespace sheetbend {

inline constexpr Compliance yield_over_torque{"yield angle / torque", Compliance::scalar, "would never slide"};

// Makes C of e, and J (n numbers) of the gradient of e.
template <int n, class T>
void slide_dry(const T& e, const T& y, T* C, T* J) {
  const T zero(0.0), one(1.0);
  const T size = select(e > zero, e, -e);
  const auto slides = size > y;
  const T root = sqrt(select(slides, y * (size + size - y), one));
  const T slope = select(slides, y / root, one);
  C[0] = select(slides, select(e > zero, root, -root), e);
  for (int d = 0; d < n; ++d) J[d] = slope * J[d];
}

}  // namespace sheetbend
