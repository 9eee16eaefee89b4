// The rows of connected constraints in their matrix J W J^T: the order in which they are eliminated, the rows that each particle takes part in, and the
// pattern of the factor. Two rows meet where they share a particle that can move.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "core/solver/plan.h"

namespace sheetbend {

// Numbers the rows of the members, and behind them those of the volumes.
RowsOfNodes number_rows(const Scene& scene, std::vector<Member>& members, std::span<BlockVolume> volumes);

struct Elimination {
  RowsOfNodes rows;
  FactorStructure structure;
};

// Numbers them in the given order where that makes a band, otherwise in one of low fill. loop_pivot: of members that close a loop of bodies (body_loops.h),
// otherwise 0.
Elimination order_rows(const Scene& scene, std::vector<Member>& members, double loop_pivot,
                       std::span<BlockVolume> volumes = {});

// Adds the entries (row, column) of the lower triangle where the rows of one particle meet.
template <class Uses>
void add_entries_of_particle(const Uses& uses, std::vector<std::pair<int, int>>& entries) {
  for (const auto& one : uses)
    for (const auto& other : uses)
      if (other.row <= one.row) entries.emplace_back(one.row, other.row);
}

}  // namespace sheetbend
