// Loops of bodies, as two hinges of a door close one: some rows of their joints follow from others (loop_rows.h). In blocks that have one, a pivot counts
// as zero up to a larger share than in others, since bodies stand apart by what a substep leaves.
#pragma once

#include <vector>

#include "core/scene/scene.h"
#include "core/solver/ordering.h"

namespace sheetbend {

inline constexpr double pivot_of_loop = 1e-6;  // 1e-3 rad

// Whether these members close a loop of bodies, or of bodies and the ground. Two bodies are joined by a group that has two or three rows between points of
// both, whatever its kind; by more rows they are joined twice. A single row, as of a spring or a stop, joins nothing.
// A body whose center alone is held is joined to the ground there.
bool closes_loop(const Scene& scene, const std::vector<Member>& members);

// Puts what makes bodies rigid before what joins them, each in its order, so that of rows that say the same those of joints are left out: a joint in place of
// a body's own row may hold it by a short lever. It adds nothing to the factor, since the joints of a body share all of its axes.
void order_bodies_first(const Scene& scene, std::vector<Member>& members);

}  // namespace sheetbend
