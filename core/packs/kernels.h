// Kernels of eight constraints at a time, as plain arrays see them: one per kind of constraint and layout, compiled once per instruction set
// and chosen at run time. This namespace is the only one that the compiled variants share; see adjoint/packs/kernel_table.cpp.
#pragma once

namespace sheetbend_blocks {
struct Table;             // kernels of direct blocks, see core/blocks/kernels.h
struct PotentialKernels;  // of implicit ones, see core/blocks/potential_kernels.h
struct Supernodes;        // see core/blocks/supernodes.h

// UnsymmetricSupernodalFactor::factorize, see core/blocks/unsymmetric_supernodes.h
using FactorUnsymmetric = bool(const Supernodes&, double* lower, double* upper, double* inverse, int* from,
                               double* work, int* place);
}  // namespace sheetbend_blocks
namespace sheetbend_points {
struct Table;  // of what a substep does point by point, see core/points/kernels.h
}

namespace sheetbend_packs {

inline constexpr int lanes = 8;
inline constexpr int row = 4;  // numbers per particle: three coordinates and one to spare, so that one load brings all

// Where the eight lanes come from.
enum Layout : int {
  across_color,   // eight constraints of one color, one scene: rows (rows, 4), `nodes` (packs, arity, 8)
  across_scenes,  // one constraint of eight scenes: rows (rows, 4, 8), a pack per constraint, `nodes` as above
  layouts
};

// Numbers per constraint in `values` and `record` below.
constexpr int value_count(bool damped, int parameters, bool unit_gradients, int arity) {
  return (damped ? 3 : 1) + parameters + (unit_gradients ? 1 : 0) + arity;
}
constexpr int record_size(int kept, int rows) { return kept + 2 * rows; }

// One color. Lanes come last everywhere: (packs, ..., 8).
struct Forward {
  int count;         // constraints; across a color the rest of the last pack repeats the last one
  bool fresh;        // lambda counts as zero, whatever it holds: who works on it clears it
  const int* nodes;  // where the particles' rows begin
  double* rows;
  const double*
      values;  // (packs, value_count, 8): a, where damped g and 1/(1+g), the constraint's own parameters, the inverse of a matrix
               // that does not depend on x, the particles' effective inverse masses
  double* lambda;     // (packs, rows of the constraint, 8)
  const double* C_r;  // likewise; null where nothing is damped
  double* record;     // (packs, record_size, 8): what the reverse keeps of x, lambda and dl; null where nothing is kept
};

struct Reverse {
  int count;
  bool fresh;  // so does lambda_bar
  const int* nodes;
  const double* values;
  const double* C_r;
  const double* record;
  double* rows_bar;    // of the coordinates; in the fourth place of the inverse masses
  double* values_bar;  // (packs, 2 + parameters, 8): of a, g and the constraint's own parameters, added to
  double* lambda_bar;  // (packs, rows of the constraint, 8)
  double* C_r_bar;
};

// The same color's projections along directions, eight per number: they read what Forward does before it writes.
struct Tangents {
  Forward values_of;
  int directions;  // how many of the eight count
  double *rows, *values, *lambda, *C_r;
};

// Of one kind.
struct KindKernels {
  void (*project[layouts])(const Forward&, int begin, int end);
  void (*project_tangents)(const Tangents&, int begin, int end);
  void (*project_vjp[layouts])(const Reverse&, int begin, int end);
};

struct KernelTable {
  const char* name;
  const KindKernels* const* kinds;  // by number
  const sheetbend_blocks::Table* blocks;
  const sheetbend_blocks::PotentialKernels* potential;
  const sheetbend_points::Table* points;
  sheetbend_blocks::FactorUnsymmetric* factor_unsymmetric;  // of implicit blocks with sliding contacts
};

}  // namespace sheetbend_packs
