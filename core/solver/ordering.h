// Deterministic orderings: colors for Gauss-Seidel, elimination order for direct blocks.
#pragma once

#include <vector>

#include "core/scene/scene.h"
#include "core/solver/plan.h"

namespace sheetbend {

// Greedy coloring of each group in turn, in the scene's order: each constraint takes the first color whose movable nodes it does not touch.
// A color's constraints then stand in the order of their lowest node.
std::vector<Color> color_constraints(const Scene& scene);

// Connected sets of constraints (through movable nodes and kept volumes), each in an order that makes a chain a narrow band: nodes are numbered by
// Cuthill-McKee from an end, constraints follow their first node.
std::vector<std::vector<Member>> connected_chains(const Scene& scene);

// Reorders members by approximate minimum degree, for branches and loops.
void order_for_low_fill(const Scene& scene, std::vector<Member>& members);

}  // namespace sheetbend
