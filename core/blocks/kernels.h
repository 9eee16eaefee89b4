// Kernels of a direct block, as plain arrays of doubles see them; compiled once per instruction set and chosen at run time with those of
// core/packs. There is a set for one scene, whose members go eight to a pack, and one for eight scenes in the lanes of every number.
#pragma once

namespace sheetbend_blocks {

inline constexpr int lanes = 8;
inline constexpr int row =
    4;  // numbers per particle (coordinates and inverse mass) and per gradient row (the last one unused)

// The block's members of one group, in elimination order; a short last pack repeats its last member. Lanes come last everywhere.
struct Run {
  int kind, count;
  bool damped;
  const int* nodes;      // (packs, arity, 8): where the particles' rows begin
  const int* gradients;  // (packs, arity, 8): where the member's first gradient row on that particle begins
  const int* first_row;  // (packs, 8): of the block's matrix
  const double* values;  // per pack or member: a, then where damped g and 1/(1+g), then the constraint's own parameters
  double* values_bar;    // of a, g and the constraint's own parameters, added to
};

// Numbers per pack or member in `values`.
constexpr int value_count(bool damped, int parameters) { return (damped ? 3 : 1) + parameters; }

// A sparse factor by supernodes, see supernodes.h.
struct Update {
  int source, begin, end;  // an earlier supernode, and which of its rows are columns of this one
};
struct Supernodes {
  int count, widest, longest;   // most columns of one, most numbers of a column
  const int* first;             // (count + 1): columns
  const int *row_start, *rows;  // those below its columns, ascending
  const int* length;            // (count): of a column in memory
  const long* panel;            // (count): where its numbers begin
  const int* update_start;      // (count + 1)
  const Update* updates;
  double least_pivot;  // a smaller one, as a share of its row's own diagonal, counts as zero (core/scalar/pivot.h)
};

// One iteration of a block. Particles: the movable ones first, then one per use of a fixed one. Rows are those of the matrix. A particle's
// gradient rows stand together: all rows that it takes part in, `rows` says which; in a band they follow one another without a gap.
struct Block {
  const Run* runs;
  int run_count, movable, particles, size, band;
  const int* window;  // (particles + 1): where a particle's gradient rows begin
  const int* rows;    // (window[particles])

  const double* x;         // (particles, 4) before the projection
  double* x_next;          // after it
  const double* lambda;    // (size) before
  double* lambda_next;     // after
  const double* C_r;       // (size) references of damped rows
  const double* diagonal;  // (size) a/(1+g)
  double* gradients;       // (window[particles], 4)
  double* matrix;          // the band, see band.h; unused where there is none
  double* inverse;         // of the pivots
  double* dl;              // (size) right side, then the correction
  double* u;               // (particles, 4) J^T dl

  // The reverse.
  double* x_bar;  // (particles, 4) of coordinates and, added to, of inverse masses
  double* z;      // (particles, 4) x'_bar - J^T y, zero where nothing can move
  double* y;      // (size)
  double* lambda_bar;
  double* C_r_bar;
};

// What the damped constraints are at a state, and the reverse of that.
struct Values {
  const Run* runs;
  int run_count;
  const double* x;  // (particles, 4), the last number unused
  double* C;        // (size)

  const double* C_bar;  // (size) times `scale` their cotangents
  double scale;
  double* x_bar;  // (particles, 4), added to
};

// The damping references of a substep, C_r = (1 - before) C + before C_before with angles on one branch.
struct References {
  const Run* runs;
  int run_count;
  double before;    // 0 where C alone counts
  const double* C;  // (size) at n
  const double* C_before;
  double* C_r;
};

// All of one kind of scalar. `factor` and `solve` are for bands.
struct Forward {
  void (*evaluate)(const Block&);          // gradients, and the right side into dl
  void (*factor)(const Block&);            // fills the band and factors it
  void (*solve)(const Block&, double* b);  // b is as long as the block and its band
  void (*push)(const Block&);              // u, x_next and lambda_next from dl
  void (*values)(const Values&);
  void (*refer)(const References&);
  // L over A in `panels`; `work` has 4 (widest + longest) numbers, `place` as many as the matrix has columns.
  void (*factor_supernodes)(const Supernodes&, double* panels, double* inverse, double* work, int* place);
};

struct Reverse {
  void (*right_side)(const Block&);  // y = lambda_bar + J W x_bar
  void (*spread)(const Block&);      // z, and x_bar of what J^T y carries on
  void (*pull_back)(const Block&);   // the constraints' own share
  void (*values)(const Values&);
};

// The same arrays' derivatives along eight directions; directions come last: (..., 8). Values are those of packs of members: (packs, count, 8, 8).
struct Tangents {
  const double* const* values;  // per run
  const double *x, *lambda, *C_r;
  double *x_next, *lambda_next;
  double* dl;  // (size and band)
  double* u;   // (particles, 4) those of W J^T dl for a dl that stands still
};

struct ValueTangents {
  const double* const* values;
  const double* x;
  double* C;
};

struct ReferenceTangents {
  const double *C, *C_before;
  double* C_r;
};

// Beside those of one scene: right_side() after solve() there, solve() for eight right sides, push() before the one there.
struct TangentKernels {
  void (*right_side)(const Block&, const Tangents&);
  void (*solve)(const Block&, double* b);  // (size and band, 8)
  void (*push)(const Block&, const Tangents&);
  void (*values)(const Values&, const ValueTangents&);
  void (*refer)(const References&, int size, const ReferenceTangents&);
};

struct Kernels {
  Forward forward;
  Reverse reverse;
};

// What one kind of constraint adds to the kernels above: its own runs.
struct ForwardOfKind {
  void (*evaluate)(const Block&, const Run&);
  void (*values)(const Values&, const Run&);
  void (*refer)(const References&, const Run&);
};
struct ReverseOfKind {
  void (*pull_back)(const Block&, const Run&);
  void (*values)(const Values&, const Run&);
};
struct TangentsOfKind {
  void (*right_side)(const Block&, const Tangents&, int run);
  void (*values)(const Values&, const ValueTangents&, int run);
};

struct Table {
  Kernels one;              // of one scene
  Kernels many;             // of eight
  TangentKernels tangents;  // of one scene along eight directions
};

}  // namespace sheetbend_blocks
