// Kernels of contacts between sweeps, eight particles of a collider at a time, as plain arrays see them; compiled once per instruction set and chosen at
// run time as those of core/packs are. Lanes come last everywhere: (packs, ..., 8).
#pragma once

namespace sheetbend_contacts {

inline constexpr int lanes = 8;
// A particle's own: from (3), carried (3) and kappa as in core/contact/touch.h, and w, its inverse mass.
inline constexpr int point_numbers = 8;
// Of a pass: where the particle is (3), the force on it (3), and whether it is pushed (1 or 0).
inline constexpr int push_numbers = 7;
inline constexpr int pose_numbers = 12;  // a position and the axes
inline constexpr int most_sizes = 4;
inline constexpr int shared_numbers = 4 + most_sizes;  // of all particles: friction, radius, loss, kappa, sizes

// Coordinate d of a node is data[(stride * node + d) * apart]. Of scenes in the lanes of packs, `apart` is the number of lanes and `data` begins at the
// lane of one scene; of a scene alone, `apart` is 1.
template <class Number>
struct Points {
  Number* data;
  int stride, apart;
};
using Given = Points<const double>;
using Written = Points<double>;

// The contacts of one collider in one substep.
struct Contacts {
  int count;                   // the rest of the last pack repeats the last particle
  const int *nodes, *carries;  // (packs, 8): the particles, and the nodes whose coordinates are their forces
  bool dissipates;
  double friction, radius, loss, size[most_sizes];
  double now, before, eta2;  // as in Bdf
  bool soft;
  double kappa;  // of a soft contact; of a rigid one kappa w
  double next[pose_numbers], pose_now[pose_numbers], pose_before[pose_numbers];
  Given x, x_before, w;  // at n and n-1; inverse masses
  double* numbers;       // (packs, point_numbers, 8)
  char* ready;           // (packs, 8): whether they are there; by registers, as `pushes` below
};

// A pass over them. `push_before` and `pushes_before` are of the pass before, null at the first one; they may be the arrays that are written.
struct Pass {
  Written q;
  double* push;  // (packs, push_numbers, 8)
  char* pushes;  // (packs, 8): whether there is one; the first lane of a register stands for all of its lanes
  const double* push_before;
  const char* pushes_before;
};

// The end of a substep: rate times the tangential forces at x go to the nodes that carry them.
struct Carry {
  Given x;
  Written carried;
  double rate;
  char* modes;  // (packs, 8): 0 apart, 1 sticks, 2 slides
};

// Cotangents, all added to but `force`: the reverse of a pass replaces it by that of the pass before.
struct Cotangents {
  double* numbers;  // (packs, point_numbers, 8)
  double* force;    // (packs, 3, 8), of the pass at hand
  double* shared;   // (shared_numbers, 8), lane by lane, as are those of poses (pose_numbers, 8)
  double *next, *pose_now, *pose_before;
};

struct Kernels {
  // Returns which of the contacts finds no place on the surface, or -1.
  int (*project)(const Contacts&, const Pass&);
  void (*carry)(const Contacts&, const Carry&);
  // Whether one is inside at x that was not at n.
  bool (*begins)(const Contacts&, const Given& x);
  // Pass::q are the cotangents of the coordinates.
  void (*project_vjp)(const Contacts&, const Pass&, const Cotangents&);
  // Reads the cotangents of the forces from Carry::carried, and adds those of the particles to x_bar.
  void (*carry_vjp)(const Contacts&, const Carry&, const Written& x_bar, const Cotangents&);
};

struct Table {
  const Kernels* shapes;  // by number, of closed ones
  // Cotangents of the particles' numbers to those of the states and of inverse masses.
  void (*numbers_vjp)(const Contacts&, const Cotangents&, const Written& x_bar, const Written& x_before_bar,
                      const Written& w_bar);
  const char* name;  // of the instruction set, as in sheetbend_packs::KernelTable
};

}  // namespace sheetbend_contacts
