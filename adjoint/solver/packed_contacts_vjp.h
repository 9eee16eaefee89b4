// The reverse of contacts eight at a time (core/solver/packed_contacts.h): cotangents of one scene's PackedContacts, which gather over the passes of a substep.
#pragma once

#include "adjoint/solver/contact_source_vjp.h"
#include "core/solver/packed_contacts.h"

namespace sheetbend {

class PackedContactCotangents {
 public:
  void resize(const SweptGroup& group);
  static std::size_t bytes(const SweptGroup& group);
  void clear();

  sheetbend_contacts::Cotangents cotangents();

  // What has gathered goes to the states, the inverse masses, the inputs and the poses.
  template <class T>
  void spread(const ContactSource<T>& source, const SweptGroup& group, const PackedContacts& contacts,
              const StateCotangents<T>& from_bar, const Inputs<T>& in_bar, T* w_bar, ColliderPoses<double>& poses_bar);

 private:
  static double sum(Numbers<double>& numbers, int i);
  static void add_pose(Numbers<double>& numbers, Pose<double>& to);

  Numbers<double> numbers_, force_, shared_, next_, now_, before_;
};

template <class T>
void PackedContactCotangents::spread(const ContactSource<T>& source, const SweptGroup& group,
                                     const PackedContacts& contacts, const StateCotangents<T>& from_bar,
                                     const Inputs<T>& in_bar, T* w_bar, ColliderPoses<double>& poses_bar) {
  const Contact& c = source.scene.contacts[group.contact];
  contact_kernels().numbers_vjp(contacts.contacts(), cotangents(), scene_points(from_bar.x, 3, source.lane),
                                scene_points(from_bar.x_before, 3, source.lane), scene_points(w_bar, 1, source.lane));
  ContactNumbers<double> bar{};
  bar.friction = sum(shared_, 0), bar.radius = sum(shared_, 1), bar.loss = sum(shared_, 2), bar.kappa = sum(shared_, 3);
  for (int k = 0; k < most_sizes; ++k) bar.size[k] = sum(shared_, 4 + k);
  shared_numbers_vjp(source, group.contact, bar, in_bar);
  add_pose(next_, poses_bar.next[c.collider]);
  add_pose(now_, poses_bar.now[c.collider]);
  if (!poses_bar.before.empty()) add_pose(before_, poses_bar.before[c.collider]);
}

}  // namespace sheetbend
