#include "adjoint/solver/packed_contacts_vjp.h"

namespace sheetbend {
namespace {

using sheetbend_contacts::point_numbers, sheetbend_contacts::shared_numbers, sheetbend_contacts::pose_numbers;
constexpr std::size_t lanes_of_sums = sheetbend_contacts::lanes;

}  // namespace

void PackedContactCotangents::resize(const SweptGroup& group) {
  numbers_.assign(group.nodes.size() * point_numbers);
  force_.assign(group.nodes.size() * 3);
  shared_.assign(lanes_of_sums * shared_numbers);
  for (auto* pose : {&next_, &now_, &before_}) pose->assign(lanes_of_sums * pose_numbers);
}

std::size_t PackedContactCotangents::bytes(const SweptGroup& group) {
  return Numbers<double>::bytes(group.nodes.size() * point_numbers) + Numbers<double>::bytes(group.nodes.size() * 3) +
         Numbers<double>::bytes(lanes_of_sums * shared_numbers) +
         3 * Numbers<double>::bytes(lanes_of_sums * pose_numbers);
}

void PackedContactCotangents::clear() {
  for (auto* own : {&numbers_, &force_, &shared_, &next_, &now_, &before_}) own->clear();
}

sheetbend_contacts::Cotangents PackedContactCotangents::cotangents() {
  return {numbers_.numbers(), force_.numbers(), shared_.numbers(), next_.numbers(), now_.numbers(), before_.numbers()};
}

double PackedContactCotangents::sum(Numbers<double>& numbers, int i) {
  double total = 0.0;
  for (std::size_t lane = 0; lane < lanes_of_sums; ++lane) total += numbers[lanes_of_sums * i + lane];
  return total;
}

void PackedContactCotangents::add_pose(Numbers<double>& numbers, Pose<double>& to) {
  to.position = to.position + Vec3<double>(sum(numbers, 0), sum(numbers, 1), sum(numbers, 2));
  for (int k = 0; k < 9; ++k) to.turn[k] += sum(numbers, 3 + k);
}

}  // namespace sheetbend
