// The contacts of an implicit block in one substep, of one scene.
#pragma once

#include "core/solver/contact_source.h"
#include "core/solver/plan.h"

namespace sheetbend {

template <class S>
struct BlockContacts {
  ColliderPoses<S> poses;
  std::vector<ContactNumbers<S>> numbers;                // per contact of the block
  std::vector<std::array<S, most_point_nodes>> weights;  // likewise, of the nodes of its point

  void resize(const DirectBlock& block) {
    numbers.resize(block.contacts.size());
    weights.resize(block.contacts.size());
  }
  static std::size_t bytes(const Scene& scene, const DirectBlock& block) {
    if (block.contacts.empty()) return 0;
    return (sizeof(ContactNumbers<S>) + sizeof(S) * most_point_nodes) * block.contacts.size() +
           3 * sizeof(Pose<S>) * scene.colliders.size();
  }

  template <class T>
  void load(const ContactSource<T>& source, const ColliderPoses<S>& given, const DirectBlock& block) {
    poses = given;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const BlockContact& c = block.contacts[i];
      numbers[i] = source.numbers(poses, c.contact, c.item);
      for (int k = 0; k < c.nodes; ++k) weights[i][k] = source.weight(source.scene.contacts[c.contact], c.item, k);
    }
  }

  // Whether restitution lifts any: such stiff contacts take more passes to the derivatives' last digits.
  bool lifts() const {
    return std::any_of(numbers.begin(), numbers.end(), [](const ContactNumbers<S>& n) { return n.firm > 1.0; });
  }

  // Where the point of contact i is; at(particle) are the block's.
  template <class At>
  Vec3<S> point(const DirectBlock& block, int i, At&& at) const {
    const BlockContact& c = block.contacts[i];
    Vec3<S> sum = at(c.particles[0]);
    if (c.nodes == 1) return sum;
    sum = weights[i][0] * sum;
    for (int k = 1; k < c.nodes; ++k) sum = sum + weights[i][k] * at(c.particles[k]);
    return sum;
  }
  // Of the block's coordinates in rows of four.
  Vec3<S> point(const DirectBlock& block, int i, const S* rows) const {
    return point(block, i, [&](int particle) { return Vec3<S>(rows + sheetbend_blocks::row * particle); });
  }

  // Of contact i: what acts on its point at x, in the collider's frame; `pose` turns it.
  const Pose<S>& pose(const DirectBlock& block, int i) const { return poses.next[block.contacts[i].collider]; }
  Touch<S> at(const DirectBlock& block, int i, const Vec3<S>& x) const {
    return touch(block.contacts[i].shape, pose(block, i).in_frame(x), numbers[i]);
  }
};

// The values of what a scalar carries more than a value of.
template <class S>
void take_values(const BlockContacts<S>& c, BlockContacts<double>& all) {
  all.poses.next.resize(c.poses.next.size());
  for (std::size_t i = 0; i < c.poses.next.size(); ++i) {
    const Pose<S>& pose = c.poses.next[i];
    Pose<double>& to = all.poses.next[i];
    to.position = values_of(pose.position);
    for (int k = 0; k < 9; ++k) to.turn[k] = value_of(pose.turn[k]);
  }
  for (std::size_t i = 0; i < c.numbers.size(); ++i) {
    all.numbers[i] = values_of(c.numbers[i]);
    for (int k = 0; k < most_point_nodes; ++k) all.weights[i][k] = value_of(c.weights[i][k]);
  }
}

}  // namespace sheetbend
