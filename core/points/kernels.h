// Kernels of what a substep does point by point, over lanes and over duals of forward rollouts, as plain arrays see it; compiled once per
// instruction set and chosen at run time with those of core/packs.
#pragma once

namespace sheetbend_points {

// A director that is made a unit vector again, and its frame's axis: from `tail` to `head`, or (without a tail) the normal `head`. A normal is
// its own head. They are given by where their coordinates begin.
struct Frame {
  int director, tail, head;
};

// Coordinates are (points, 3) but for those being corrected, whose points are `stride` numbers apart. Every number is a scalar of its kind.
struct Points {
  double eta, now, before, extrapolate_now, extrapolate_before;  // as in Bdf
  const char *inertial, *director, *has_weight;                  // per point
  const double *x, *x_before, *v, *v_before;                     // at n and n-1
  const double *mass, *drag_linear, *drag_quadratic;
  const double *gravity, *wind;
  double *w, *kept;  // effective inverse masses; m w, null without drag
  double* q;
  int stride;
  double *x_next, *v_next;
};

// Of the points [begin, end).
struct Kernels {
  void (*effective_masses)(const Points&, int begin, int end);  // w and kept of what has inertia, with drag
  void (*predict)(const Points&, int begin, int end);           // q, without forces, of points that nothing holds
  bool (*update_velocities)(const Points&, int begin,
                            int end);  // x_next and v_next from q; whether all of it is finite
  void (*retract)(const Frame*, int frames, double* x);
  // A point at `to`: the sum of weight[k] times the one at values + between k (in scalars), which stands at a knot.
  void (*interpolate)(const double* values, long between, const double* weight, int knots, double* to);
};

struct Table {
  Kernels lanes;                              // eight scenes
  Kernels four_directions, eight_directions;  // duals
};

}  // namespace sheetbend_points
