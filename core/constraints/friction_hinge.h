// friction_hinge: dry friction about a fixed unit normal; a torsion spring that slides. With e = theta - set, theta the angle of hinge.h,
//
//   C = e where |e| <= y,   C = sign(e) sqrt(y (2 |e| - y)) beyond   [rad],
//
// so the energy C^2/(2 alpha) is quadratic up to y and grows linearly from there (Huber 1964): the torque C dC/de / alpha is e/alpha while the
// joint sticks and y/alpha, the torque of Coulomb's friction, while it slides. The balance at the end of a substep decides which, so that the
// torque depends neither on the rate nor on the substep. The set, the first number of the stencil's last node, then follows the angle at the
// distance y (yield.h): elastic and perfectly plastic, what Dahl's law (1968) becomes for its largest exponents.
// Compliance alpha in rad/(N m), the parameter `yield` is y: alpha = y/T for the torque T. A compliance of zero never slides and is refused at
// validation. Solvers that take a fixed number of iterations ask for a friction that stops nothing within a substep, h^2 T/inertia < y.
// Degenerate: as hinge.
#pragma once

#include "core/constraints/hinge.h"

namespace sheetbend {

// The angle from the set, which the sliding spring of friction_hinge is turned by.
struct AngleFromSet : OnPoints<4> {
  static constexpr int points = 3;
  static constexpr int rows = 1;
  static constexpr std::array parameters{Parameter{"normal_x", units::none, ranges::any, defaults::normal},
                                         Parameter{"normal_y", units::none, ranges::any, defaults::normal},
                                         Parameter{"normal_z", units::none, ranges::any, defaults::normal},
                                         Parameter{"yield", units::radians, ranges::positive, defaults::given}};

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    const T about_set[] = {p[0], p[1], p[2], x[9]};
    Hinge::evaluate(x, about_set, C, J);
    J[9] = T(-1.0);
    J[10] = J[11] = T(0.0);
  }
};

struct FrictionHinge : AngleFromSet {
  static constexpr const char* name = "friction_hinge";
  static constexpr const char* about =
      "the angle of a hinge from the one it slid to, which is the x of the last particle (pinned)";
  static constexpr Unit unit = units::radians;
  static constexpr Compliance compliance{"yield angle / torque", Compliance::scalar, "would never slide"};
  static constexpr bool hot = true;
  static constexpr int yield_parameter = 3;
  using Slider = AngleFromSet;

  template <class T>
  static void evaluate(const T* x, const T* p, T* C, T* J) {
    T e;
    AngleFromSet::evaluate(x, p, &e, J);
    const T zero(0.0), one(1.0), y = p[yield_parameter];
    const T size = select(e > zero, e, -e);
    const auto slides = size > y;
    const T root = sqrt(select(slides, y * (size + size - y), one));
    const T slope = select(slides, y / root, one);
    C[0] = select(slides, select(e > zero, root, -root), e);
    for (int d = 0; d < dofs; ++d) J[d] = slope * J[d];
  }
};

}  // namespace sheetbend
