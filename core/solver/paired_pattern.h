// The pattern of an implicit block's matrix: as the plan has it, and with pairs that touch beside it.
#pragma once

#include "core/solver/plan.h"

namespace sheetbend {

// Where the lower triangles of a run's matrices stand in a pattern, as MemberRun::entries.
std::vector<int> entries_of(const Scene& scene, const DirectBlock& block, const MemberRun& run,
                            const CondensedPattern& pattern);

struct PairedPattern {
  CondensedPattern pattern;
  std::vector<std::vector<int>> entries;  // per run
};

// With the particles of each of these pairs joined beside those that the plan knows.
PairedPattern pattern_with(const Scene& scene, const DirectBlock& block, const std::vector<PairKey>& pairs);

}  // namespace sheetbend
