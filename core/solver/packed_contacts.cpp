#include "core/solver/packed_contacts.h"

#include <algorithm>

namespace sheetbend {
namespace {

using sheetbend_contacts::point_numbers, sheetbend_contacts::push_numbers;
static_assert(sheetbend_contacts::lanes == Pack::lanes && sheetbend_contacts::most_sizes == most_sizes);

void write_pose(const Pose<double>& pose, double* to) {
  pose.position.store(to);
  std::copy_n(pose.turn, 9, to + 3);
}

}  // namespace

void PackedContacts::resize(const SweptGroup& group, int kept_iterations) {
  const std::size_t places = group.nodes.size(), passes = std::max(1, kept_iterations);
  numbers_.assign(places * point_numbers);
  pushes_.assign(passes * places * push_numbers);
  ready_.resize(places);
  pushing_.resize(passes * places);
  modes_.resize(places);
}

std::size_t PackedContacts::bytes(const SweptGroup& group, int kept_iterations) {
  const std::size_t places = group.nodes.size(), passes = std::max(1, kept_iterations);
  return Numbers<double>::bytes(places * point_numbers) + Numbers<double>::bytes(passes * places * push_numbers) +
         (2 + passes) * places;
}

void PackedContacts::begin(const SweptGroup& group, const ColliderPoses<double>& poses, int collider) {
  contacts_.count = group.count;
  contacts_.nodes = group.nodes.data(), contacts_.carries = group.carries.data();
  write_pose(poses.next[collider], contacts_.next);
  write_pose(poses.now[collider], contacts_.pose_now);
  if (!poses.before.empty()) write_pose(poses.before[collider], contacts_.pose_before);
  contacts_.numbers = numbers_.numbers();
  contacts_.ready = ready_.data();
  std::fill(ready_.begin(), ready_.end(), false);
}

sheetbend_contacts::Pass PackedContacts::pass(int iteration, const sheetbend_contacts::Written& q) {
  const std::size_t places = ready_.size();
  const auto place = [&](int i) { return pushing_.size() == places ? 0 : i * places; };
  const auto own = [&](int i) { return pushes_.numbers() + place(i) * push_numbers; };
  sheetbend_contacts::Pass p{q, own(iteration), pushing_.data() + place(iteration), nullptr, nullptr};
  if (iteration == 0) return p;
  p.push_before = own(iteration - 1);
  p.pushes_before = pushing_.data() + place(iteration - 1);
  return p;
}

const sheetbend_contacts::Kernels& contact_kernels(const Scene& scene, const SweptGroup& group) {
  return contact_kernels().shapes[scene.colliders[scene.contacts[group.contact].collider].shape];
}

}  // namespace sheetbend
