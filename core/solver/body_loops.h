// Loops of bodies, as two hinges of a door close one: rows of their joints follow from others where the bodies are as the joints let them. In the
// prediction of a substep, which drag, loads and kept spins turn apart by some angle, such a row keeps the square of that angle of its own diagonal as
// pivot, and would push with forces that nothing asks for. So a pivot counts as zero up to a larger share than in other blocks.
#pragma once

#include <vector>

#include "core/scene/scene.h"
#include "core/solver/ordering.h"

namespace sheetbend {

inline constexpr double pivot_of_loop = 1e-6;  // 1e-3 rad

// Whether these members close a loop of bodies, or of bodies and the ground.
bool closes_loop(const Scene& scene, const std::vector<Member>& members);

}  // namespace sheetbend
