// Contacts of particles that go by sweeps. After each pass over the constraints every contact is projected: what the constraints and other contacts have
// made of its particle, its own force of the pass before taken off, is y; the particle goes to x = y + w F(x) (core/contact/balanced.h). F is
// the force of the whole substep and no increment, so that Coulomb's limit is that of the whole push, and what a contact pushed too far in an early pass
// it takes back later. One thread works, in the order of contacts, so bits do not depend on their number. Plain numbers go eight contacts at a time
// (packed_contacts.h), other scalars one by one; plain numbers have the same bits in both.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "core/contact/balanced.h"
#include "core/solver/contact_source.h"
#include "core/solver/packed_contacts.h"
#include "core/solver/plan.h"
#include "core/solver/unbalanced.h"

namespace sheetbend {

// Whether a group goes in packs, in scenes of an S.
template <class S>
bool goes_in_packs(const SweptGroup& group) {
  return std::is_same_v<S, double> && group.packed();
}

template <class S>
bool all_go_in_packs(const Plan& plan) {
  return !plan.contact_groups.empty() &&
         std::ranges::all_of(plan.contact_groups, [](const SweptGroup& group) { return goes_in_packs<S>(group); });
}

// The contacts of one scene of a T.
template <class S>
struct SweptContacts {
  // Where a particle is after its projection, and the force in multipliers; in the world's frame. None where it does not push.
  struct Push {
    Vec3<S> x, force;
    bool pushes = false;
  };
  ColliderPoses<S> poses;
  // Of contacts one by one, none where all go in packs. Those that have not come near have what all points share.
  std::vector<ContactNumbers<S>> numbers;
  // Likewise: whether all its numbers are at hand, because a pass found it below the surface, or it rebounds.
  std::vector<char> near;
  std::vector<Push> pushes;            // contact after contact, of all passes or the last one
  std::vector<PackedContacts> packed;  // per group; empty of those that go one by one

  static std::size_t one_by_one(const Plan& plan) { return all_go_in_packs<S>(plan) ? 0 : plan.contacts.size(); }
  void resize(const Plan& plan, int kept_iterations) {
    const std::size_t own = one_by_one(plan);
    numbers.resize(own);
    near.resize(own);
    pushes.resize(std::max(1, kept_iterations) * own);
    packed.resize(plan.contact_groups.size());
    for (std::size_t g = 0; g < packed.size(); ++g)
      if (goes_in_packs<S>(plan.contact_groups[g])) packed[g].resize(plan.contact_groups[g], kept_iterations);
  }
  static std::size_t bytes(const Scene& scene, const Plan& plan, int kept_iterations) {
    std::size_t sum =
        3 * sizeof(Pose<S>) * scene.colliders.size() + sizeof(PackedContacts) * plan.contact_groups.size() +
        (sizeof(ContactNumbers<S>) + sizeof(char) + std::max(1, kept_iterations) * sizeof(Push)) * one_by_one(plan);
    for (const SweptGroup& group : plan.contact_groups)
      if (goes_in_packs<S>(group)) sum += PackedContacts::bytes(group, kept_iterations);
    return sum;
  }
  Push& push(int iteration, int i) {
    return pushes[pushes.size() == numbers.size() ? i : iteration * numbers.size() + i];
  }
  // What contact i did in the pass before; of one record, as it stands there.
  const Push& before(int iteration, int i) {
    static const Push none;
    return iteration == 0 ? none : push(iteration - 1, i);
  }

  // What a substep begins with. Where nothing touches, all that is asked for is gaps.
  template <class T>
  void begin(const ContactSource<T>& source, const ColliderPoses<S>& given, const Plan& plan) {
    poses = given;
    for (std::size_t g = 0; g < packed.size(); ++g) {
      const SweptGroup& group = plan.contact_groups[g];
      if constexpr (std::is_same_v<S, double>)
        if (group.packed()) {
          packed[g].begin(source, group, poses);
          continue;
        }
      const ContactNumbers<S> shared = source.shared_numbers(group.contact);
      for (int i = group.first; i < group.first + group.count; ++i) {
        const SweptContact& c = plan.contacts[i];
        near[i] = source.scene.contacts[c.contact].rebounds(c.item);
        numbers[i] = near[i] ? source.numbers(poses, c.contact, c.item) : shared;
      }
    }
  }
  // Whether contact i is to be looked at with its particle at y, all its numbers then at hand.
  template <class T>
  bool comes_near(const ContactSource<T>& source, const SweptContact& c, int i, const Vec3<S>& y) {
    if (near[i]) return true;
    double at[3], n[3], size[most_sizes], distance;
    for (int k = 0; k < most_sizes; ++k) size[k] = value_of(numbers[i].size[k]);
    values_of(poses.next[c.collider].in_frame(y)).store(at);
    distance_from(c.shape, at, size, distance, n);
    if (!(distance - value_of(numbers[i].radius) < 0.0)) return false;
    numbers[i] = source.numbers(poses, c.contact, c.item);
    near[i] = true;
    return true;
  }
};

// x = y + w F(x) of one contact, all in the world's frame; `found` says whether such an x is.
template <class S>
typename SweptContacts<S>::Push push_out(const AnyShape& shape, const Pose<S>& pose, const Vec3<S>& y, const S& w,
                                         const ContactNumbers<S>& numbers, bool& found) {
  constexpr bool plain = std::is_same_v<S, double>;
  const Vec3<S> own = pose.in_frame(y);
  Balanced<double> at;
  if constexpr (plain)
    at = balanced(shape, own, w, numbers);
  else
    at = balanced(shape, values_of(own), value_of(w), values_of(numbers));
  found = at.found;
  if (!at.pushes) return {y, {}, false};
  Vec3<S> z(S(at.z.x), S(at.z.y), S(at.z.z));
  if constexpr (!plain) z = balanced_near(shape, at.z, own, w, numbers);
  const Vec3<S> moved = pose.turned(z - own);
  return {y + moved, (S(1.0) / w) * moved, true};
}

[[noreturn]] inline void throw_no_place(const Scene& scene, const SweptContact& c) {
  throw Unbalanced(
      "particle " + std::to_string(c.node) + " finds no place on the surface of " + scene.contacts[c.contact].name,
      "use smaller substeps", 0, 0.0, c.node);
}

// One pass over contact i of a plan alone.
template <class T, class At>
void project_contact(const ContactSource<T>& source, const Plan& plan, int iteration, int i, At&& at,
                     SweptContacts<Single<T>>& contacts) {
  using S = Single<T>;
  const SweptContact& c = plan.contacts[i];
  T q[3] = {T(at(c.node, 0)), T(at(c.node, 1)), T(at(c.node, 2))};
  Vec3<S> y = source.read(Vec3<T>(q));
  const auto& before = contacts.before(iteration, i);
  const bool pushed = before.pushes;
  if (pushed) y = y - source.read(source.w[c.node]) * before.force;
  auto& push = contacts.push(iteration, i);
  if (!contacts.comes_near(source, c, i, y)) {
    push.pushes = false;
    return;
  }
  bool found;
  push =
      push_out(c.shape, contacts.poses.next[c.collider], y, source.read(source.w[c.node]), contacts.numbers[i], found);
  if (!found) throw_no_place(source.scene, c);
  if (!pushed && !push.pushes) return;
  source.write(push.x, q);
  for (int d = 0; d < 3; ++d) at(c.node, d) = q[d];
}

// One pass over all contacts of a scene of T, whose coordinates are in q; at(node, d) is where one stands. The first pass (0) starts from no forces. Throws
// Unbalanced.
template <class T, class At>
void project_contacts(const ContactSource<T>& source, const Plan& plan, int iteration,
                      [[maybe_unused]] const Coordinates<T>& q, At&& at, SweptContacts<Single<T>>& contacts) {
  for (std::size_t g = 0; g < plan.contact_groups.size(); ++g) {
    const SweptGroup& group = plan.contact_groups[g];
    if constexpr (std::is_same_v<Single<T>, double>)
      if (group.packed()) {
        PackedContacts& own = contacts.packed[g];
        const int lost = contact_kernels(source.scene, group)
                             .project(own.contacts(), own.pass(iteration, scene_points(q.data, q.stride, source.lane)));
        if (lost >= 0) throw_no_place(source.scene, plan.contacts[group.first + lost]);
        continue;
      }
    for (int i = group.first; i < group.first + group.count; ++i)
      project_contact(source, plan, iteration, i, at, contacts);
  }
}

}  // namespace sheetbend
