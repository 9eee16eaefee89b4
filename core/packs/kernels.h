// Kernels of eight constraints at a time, as plain arrays see them: one per kind of constraint, compiled once per instruction set and
// chosen at run time. This namespace is the only one that the compiled variants share; see kernel_table.h.
#pragma once

namespace sheetbend_blocks {
struct Table;  // core/blocks/kernels.h
}

namespace sheetbend_packs {

inline constexpr int lanes = 8;
inline constexpr int row = 4;  // numbers per particle: coordinates and inverse mass, so that one load brings all
inline constexpr int max_kinds = 32;

// Numbers per constraint in `values` and `record` below.
constexpr int value_count(bool damped, int parameters) { return (damped ? 3 : 1) + parameters; }
constexpr int record_size(int dofs, int rows) { return dofs + 2 * rows; }

// One color. Lanes come last everywhere: (packs, ..., 8).
struct Forward {
  const int* nodes;  // (packs, arity, 8) where the particles' rows begin
  double* rows;      // (rows, 4)
  const double*
      values;      // (packs, value_count, 8): a, then where damped g and 1/(1+g), then the constraint's own parameters
  double* lambda;  // (packs, rows of the constraint, 8)
  const double* C_r;  // likewise; null where nothing is damped
  double* record;     // (packs, dofs + 2 rows, 8): x, lambda and dl for the reverse; null where nothing is kept
};

struct Reverse {
  const int* nodes;
  const double* rows;  // only the inverse masses are read
  const double* values;
  const double* C_r;
  const double* record;
  double* rows_bar;    // (rows, 4)
  double* values_bar;  // (packs, 2 + parameters, 8): of a, g and the constraint's own parameters, added to
  double* lambda_bar;  // (packs, rows of the constraint, 8)
  double* C_r_bar;
};

struct KernelTable {
  const char* name;
  void (*project[max_kinds])(const Forward&, int begin, int end);
  void (*project_vjp[max_kinds])(const Reverse&, int begin, int end);
  const sheetbend_blocks::Table* blocks;
};

}  // namespace sheetbend_packs
