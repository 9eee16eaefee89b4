// Where the constraints and contacts of a condensed block stand in its matrix, whose unknowns are the coordinates of its movable particles.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "core/solver/plan.h"

namespace sheetbend {

// Adds the 3 x 3 entries of two particles with these first dofs that are in the lower triangle.
void add_entries(int row, int column, std::vector<std::pair<int, int>>& entries);

// Where `row` stands among the gradient rows of a particle of the block.
int gradient_row(const DirectBlock& block, int particle, int row);

// For a factor, in an elimination order of low fill. `particle_of`: the block's particles by node.
CondensedPattern pattern_of_factor(const Scene& scene, const DirectBlock& block, const std::map<int, int>& particle_of);

// For conjugate gradients, particles in the block's order.
CondensedIteration pattern_of_iteration(const Scene& scene, const DirectBlock& block,
                                        const std::map<int, int>& particle_of, const SolverOptions& options);

}  // namespace sheetbend
