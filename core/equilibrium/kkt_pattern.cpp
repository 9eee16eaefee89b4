// Which entries K has, in the order of elimination, and where each part of it stands among them.
#include <Eigen/OrderingMethods>
#include <algorithm>
#include <span>
#include <utility>

#include "core/equilibrium/kkt.h"

namespace sheetbend {

// Calls f(row, column) for the pairs of numbers of each element's coordinates, -1 where fixed; the diagonal is not among them.
template <class F>
void Kkt::for_each_pair(const std::vector<int>& number, F&& f) const {
  const auto pairs = [&](std::span<const int> nodes) {
    const int dofs = 3 * static_cast<int>(nodes.size());
    for (int a = 0; a < dofs; ++a)
      for (int b = 0; b < dofs; ++b)
        f(number[scene_.first_dof[nodes[a / 3]] + a % 3], number[scene_.first_dof[nodes[b / 3]] + b % 3]);
  };
  for (const Group& group : scene_.groups)
    for (int item = 0; item < group.count; ++item) pairs(group.nodes(item));
  for (const std::array<int, 3>& nodes : pressed_) pairs(nodes);
}

Kkt::Kkt(const Scene& scene) : scene_(scene), unknown_(scene.dofs(), -1), pressed_(scene.air) {
  for (const Volume& volume : scene.volumes) {
    for (const auto& [a, b, c] : volume.triangles)
      pressed_.push_back({volume.nodes[a], volume.nodes[b], volume.nodes[c]});
    border_.emplace_back(3 * volume.nodes.size());
  }
  for (const Contact& contact : scene.contacts)
    for (int item = 0; item < contact.points(); ++item) {
      if (!moves(scene, contact, item)) continue;
      PointDofs& dofs = contact_dofs_.emplace_back(PointDofs{contact.arity, {}});
      for (int k = 0; k < contact.arity; ++k) dofs.first[k] = scene.first_dof[contact.nodes_of(item)[k]];
    }
  set_pattern(order_unknowns());
  find_positions();
  metric_.assign(scene.dofs(), 1.0);
  idle_.resize(scene.directors.size());
  idle_stiffness_.resize(scene.directors.size());
  H_.resize(position_.size());
  J_.resize(scene.gradient_entries);
  softened_.resize(scene.constraints);
  factor_.analyzePattern(K_);
}

// Numbers the unknowns in the order of elimination, and returns the entries of K on and above the diagonal, without its border.
std::vector<Eigen::Triplet<double>> Kkt::order_unknowns() {
  std::vector<int> free_dof(scene_.dofs(), -1);
  for (int n = 0; n < scene_.nodes(); ++n)
    if (scene_.role[n] == Role::free)
      for (int d = 0; d < scene_.dim[n]; ++d) free_dof[scene_.first_dof[n] + d] = free_++;
  std::vector<Eigen::Triplet<double>> entries, upper;
  for (int i = 0; i < free_; ++i) entries.emplace_back(i, i, 1.0);
  for_each_contact_entry([&](std::size_t, int, double, int row, int column) {
    entries.emplace_back(free_dof[row], free_dof[column], 1.0);
  });
  for_each_pair(free_dof, [&](int a, int b) {
    if (a >= 0 && b >= 0) entries.emplace_back(a, b, 1.0);
  });
  Eigen::SparseMatrix<double> graph(free_, free_);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic> order;  // order(new) = old
  Eigen::AMDOrdering<int>()(graph, order);
  std::vector<int> place(free_);
  for (int i = 0; i < free_; ++i) place[order.indices()(i)] = i;
  for (int i = 0; i < scene_.dofs(); ++i)
    if (free_dof[i] >= 0) unknown_[i] = place[free_dof[i]];
  for (const auto& e : entries)
    if (place[e.row()] <= place[e.col()]) upper.emplace_back(place[e.row()], place[e.col()], 1.0);
  return upper;
}

// K with these entries and those of the volumes' border.
void Kkt::set_pattern(std::vector<Eigen::Triplet<double>> upper) {
  const int unknowns = free_ + static_cast<int>(scene_.volumes.size());
  for_each_border([&](int v, std::size_t, int dof) {
    if (unknown_[dof] >= 0) upper.emplace_back(unknown_[dof], free_ + v, 1.0);
  });
  for (int i = free_; i < unknowns; ++i) upper.emplace_back(i, i, 1.0);
  K_.resize(unknowns, unknowns);
  K_.setFromTriplets(upper.begin(), upper.end());
}

// Where in K's values each part's entries stand.
void Kkt::find_positions() {
  const auto position = [&](int row, int column) {
    const int *begin = K_.innerIndexPtr() + K_.outerIndexPtr()[column],
              *end = K_.innerIndexPtr() + K_.outerIndexPtr()[column + 1];
    return static_cast<int>(std::lower_bound(begin, end, row) - K_.innerIndexPtr());
  };
  const auto position_above = [&](int a, int b) { return a >= 0 && a <= b ? position(a, b) : -1; };
  for_each_pair(unknown_, [&](int a, int b) { position_.push_back(position_above(a, b)); });
  for (int i = 0; i < K_.rows(); ++i) diagonal_.push_back(position(i, i));
  for_each_contact_entry([&](std::size_t, int, double, int row, int column) {
    contact_position_.push_back(position_above(unknown_[row], unknown_[column]));
  });
  for (const Director& d : scene_.directors)
    for (int e = 0; e < 9; ++e) {
      const int first = scene_.first_dof[d.node];
      director_position_.push_back(position_above(unknown_[first + e / 3], unknown_[first + e % 3]));
    }
  for (const std::vector<double>& border : border_) border_position_.emplace_back(border.size());
  for_each_border([&](int v, std::size_t i, int dof) {
    border_position_[v][i] = unknown_[dof] >= 0 ? position(unknown_[dof], free_ + v) : -1;
  });
}

}  // namespace sheetbend
