// Plans one block: which particles and rows it has, and where they stand in its matrix.
#pragma once

#include <vector>

#include "core/solver/plan.h"

namespace sheetbend {

// The block of constraints, and of particles that none holds (`loose`).
DirectBlock make_block(const Scene& scene, std::vector<Member> members, const SolverOptions& options,
                       const std::vector<int>& loose = {});

// Per node: whether it may touch itself, or carries a point of a body that may.
std::vector<char> touching_itself(const Scene& scene);

}  // namespace sheetbend
