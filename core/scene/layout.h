// The differentiable inputs of a scene, all in one flat vector: what a gradient is taken by, and where each quantity stands in it.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace sheetbend {

enum class Quantity : int {
  position,  // initial state, every field in turn (particles x 3)  [m]
  velocity,  // initial velocity, same shape  [m/s]
  mass,  // per particle  [kg]; pinned and driven ones do not use it. Of a director: the small torque per angle from its prediction,
         // which keeps a substep well posed  [N m]
  compliance,         // per constraint, in the scene's order
  damping,            // per constraint: beta of the Rayleigh dissipation (Macklin et al. 2016, eq. 26)
  rest,               // the constraints' own parameters, constraint by constraint
  boundary,           // (knots, driven particles, 3) positions  [m]
  force,              // (knots, loaded particles, 3)  [N]
  gravity,            // (3)  [m/s^2]
  drag_linear,        // per particle  [N s/m]
  drag_quadratic,     // per particle  [N s^2/m^2]
  wind,               // (knots, 3)  [m/s]
  air_normal,         // per triangle in air: air density * drag coefficient / 2, along its normal  [kg/m^3]
  air_tangential,     // the same across the normal
  pressure,           // per triangle in air, along (x1 - x0) x (x2 - x0)  [Pa]
  volume,             // per closed surface: the one that it keeps  [m^3]
  volume_compliance,  // likewise  [m^3/Pa]
  friction,           // per contact: Coulomb's coefficient  [-]
  contact_radius,  // per contact: of its particles, from their center to where they touch; then of what touches itself; then per ball  [m]
  contact_stiffness,  // per contact that is not rigid  [N/m]
  collider_pose,      // per collider and knot: position [m] and rotation vector [rad] of its frame (2 x 3)
  collider_size,      // per collider: the lengths of its shape  [m]
  restitution,  // per contact off which particles bounce: the speed after an impact over that before; then of balls  [-]
  load,         // (knots, loads along rows): energy over the unit of C, such as N m where it is an angle
  contact_weight,  // per contact of points that several nodes carry: (points, nodes), of the nodes in their sum; m for axes. Then of what touches itself
  contact_dissipation,  // per contact that dissipates: the share of its push that a speed along the normal adds  [s/m]
};
inline constexpr int quantity_count = 26;
inline constexpr int oldest_quantity_count = 17;  // those after it are left out of saved scenes that have none of them
inline constexpr std::array<const char*, quantity_count> quantity_names{"position",
                                                                        "velocity",
                                                                        "mass",
                                                                        "compliance",
                                                                        "damping",
                                                                        "rest",
                                                                        "boundary",
                                                                        "force",
                                                                        "gravity",
                                                                        "drag_linear",
                                                                        "drag_quadratic",
                                                                        "wind",
                                                                        "air_normal",
                                                                        "air_tangential",
                                                                        "pressure",
                                                                        "volume",
                                                                        "volume_compliance",
                                                                        "friction",
                                                                        "contact_radius",
                                                                        "contact_stiffness",
                                                                        "collider_pose",
                                                                        "collider_size",
                                                                        "restitution",
                                                                        "load",
                                                                        "contact_weight",
                                                                        "contact_dissipation"};

struct Layout {
  std::array<std::size_t, quantity_count> size{};
  std::array<std::size_t, quantity_count + 1> offset{};

  void close() {
    for (int q = 0; q < quantity_count; ++q) offset[q + 1] = offset[q] + size[q];
  }
  std::size_t total() const { return offset[quantity_count]; }
  std::size_t of(Quantity q) const { return offset[static_cast<int>(q)]; }
  std::size_t count(Quantity q) const { return size[static_cast<int>(q)]; }
};

// A view of one flat vector by quantity; T may be const.
template <class T>
struct Inputs {
  const Layout& layout;
  T* data;
  T* of(Quantity q) const { return data + layout.of(q); }
  // Behind the quantities: parameters of stages that a program adds to the substep, if it gives a longer vector.
  T* beyond() const { return data + layout.total(); }
};

}  // namespace sheetbend
