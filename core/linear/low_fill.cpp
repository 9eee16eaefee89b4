#include "core/linear/low_fill.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

namespace sheetbend {

std::vector<int> places_for_low_fill(int nodes, const std::vector<std::vector<int>>& joined) {
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto& list : joined)
    for (const int a : list)
      for (const int b : list) entries.emplace_back(a, b, 1.0);
  Eigen::SparseMatrix<double> graph(nodes, nodes);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic> permutation;
  Eigen::AMDOrdering<int>()(graph, permutation);
  std::vector<int> place(nodes);
  for (int i = 0; i < nodes; ++i) place[permutation.indices()(i)] = i;
  return place;
}

}  // namespace sheetbend
