// The contacts of one group between sweeps, eight particles at a time: the arrays that the kernels (core/contact/kernels.h) work on. Where T is a pack, its
// scenes go one after the other, each as it would alone.
#pragma once

#include <algorithm>
#include <vector>

#include "core/packs/contact_tables.h"
#include "core/scalar/numbers.h"
#include "core/solver/contact_source.h"
#include "core/solver/plan.h"

namespace sheetbend {

// Coordinates of one scene of a T as these kernels see them.
template <class T>
auto scene_points(T* data, int stride, int lane) {
  using Number = std::conditional_t<std::is_const_v<T>, const double, double>;
  constexpr int apart = scenes_of<std::remove_const_t<T>>;
  return sheetbend_contacts::Points<Number>{reinterpret_cast<Number*>(data) + lane, stride, apart};
}

// The numbers of a substep, of one scene.
class PackedContacts {
 public:
  void resize(const SweptGroup& group, int kept_iterations);
  static std::size_t bytes(const SweptGroup& group, int kept_iterations);

  // What a substep begins with.
  template <class T>
  void begin(const ContactSource<T>& source, const SweptGroup& group, const ColliderPoses<double>& poses);

  // Of kernels, in a substep that has begun.
  const sheetbend_contacts::Contacts& contacts() const { return contacts_; }
  sheetbend_contacts::Pass pass(int iteration, const sheetbend_contacts::Written& q);
  sheetbend_contacts::Carry carry(const sheetbend_contacts::Given& x, const sheetbend_contacts::Written& carried,
                                  double rate) {
    return {x, carried, rate, modes_.data()};
  }
  // What each particle did at the end of the substep, as the numbers of ContactMode.
  const std::vector<char>& modes() const { return modes_; }

 private:
  void begin(const SweptGroup& group, const ColliderPoses<double>& poses, int collider);

  sheetbend_contacts::Contacts contacts_{};
  Numbers<double> numbers_;
  std::vector<char> ready_, modes_;
  // Of all passes or the last one.
  Numbers<double> pushes_;
  std::vector<char> pushing_;
};

template <class T>
void PackedContacts::begin(const ContactSource<T>& source, const SweptGroup& group,
                           const ColliderPoses<double>& poses) {
  const Contact& c = source.scene.contacts[group.contact];
  const ContactNumbers<double> shared = source.shared_numbers(group.contact);
  contacts_.now = source.bdf.now, contacts_.before = source.bdf.before;
  contacts_.eta2 = source.bdf.eta * source.bdf.eta;
  contacts_.friction = shared.friction, contacts_.radius = shared.radius, contacts_.kappa = shared.kappa;
  contacts_.loss = shared.loss, contacts_.dissipates = shared.dissipates;
  contacts_.soft = c.stiffness >= 0;
  std::copy_n(shared.size, most_sizes, contacts_.size);
  contacts_.x = scene_points(source.from.x, 3, source.lane);
  contacts_.x_before = scene_points(source.from.x_before, 3, source.lane);
  contacts_.w = scene_points(source.w, 1, source.lane);
  begin(group, poses, c.collider);
}

// Those of a group's shape.
const sheetbend_contacts::Kernels& contact_kernels(const Scene& scene, const SweptGroup& group);

}  // namespace sheetbend
