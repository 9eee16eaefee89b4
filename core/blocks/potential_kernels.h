// Kernels of an implicit block (core/solver/implicit_block.h): what its constraints add to the potential, to its gradient and to its matrix, eight
// members at a time; compiled once per instruction set like those of kernels.h.
#pragma once

#include "core/blocks/kernels.h"

namespace sheetbend_blocks {

struct Potential {
  const Run* runs;
  int run_count, particles;
  const double* x;    // (particles, 4), as in Block
  const double* C_r;  // (size) references of damped rows
  // Sums over a particle's rows, (particles, 4), the last number unused: J^T lambda, the magnitudes of its terms, and J^2/D.
  double *force, *magnitude, *stiffness;
  double* const*
      elements;  // per run the lower triangles of J^T D^-1 J - sum lambda Hess(C): (packs, triangle(dofs), 8)
};

struct PotentialKernels {
  double (*evaluate)(const Potential&);  // the sum of (C + g (C - C_r))^2/(2 a (1+g)), and the sums
  void (*find_elements)(const Potential&);
  void (*multiply)(const Potential&, const double* z,
                   double* Ez);  // Ez += E z over elements found before, (particles, 4)
};

// What one kind adds to them; all null where an implicit block does not take the kind.
struct PotentialOfKind {
  double (*evaluate)(const Potential&, const Run&);
  void (*find_elements)(const Potential&, const Run&, double* elements);
  void (*multiply)(const Run&, const double* elements, const double* z, double* Ez);
};

// All kernels of one kind in direct and implicit blocks.
struct KindKernels {
  ForwardOfKind forward, forward_of_lanes;
  ReverseOfKind reverse, reverse_of_lanes;
  TangentsOfKind tangents;
  PotentialOfKind potential;
};

}  // namespace sheetbend_blocks
