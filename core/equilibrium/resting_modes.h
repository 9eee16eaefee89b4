// Contacts of which is decided whether they are apart, stick or slide, so that forces are smooth along a step of Newton's method: an active set. Between
// steps the law decides again, and where it agrees the forces are those of the law.
#pragma once

#include "core/equilibrium/resting.h"

namespace sheetbend {

// Of one contact on its point, -d force/dx [N/m]: the 3 x 3 block of the matrix of nodes k and l of the point is that times weight[k] weight[l].
struct ContactBlock {
  double whole[9], symmetric[9];    // the latter without what the push adds to Coulomb's limit
  double weight[most_point_nodes];  // of the nodes in the point
  bool slides;                      // and has friction
};

class RestingModes {
 public:
  // Decides by the law at x. What has pushed is apart only where its gap is above `slack` [m], which rounding does not leave. Returns whether
  // anything changed.
  bool decide(const RestingContacts<double>& contacts, const double* x, double slack) {
    bool changed = modes_.size() != contacts.items.size();
    modes_.resize(contacts.items.size(), ContactMode::apart);
    for (std::size_t i = 0; i < modes_.size(); ++i) {
      auto item = contacts.items[i];
      if (modes_[i] != ContactMode::apart) item.numbers.radius += slack;
      const Touch<double> t = touch(item.shape, contacts.in_frame(item, x), item.numbers);
      const ContactMode mode = !t.pushes ? ContactMode::apart : t.slides ? ContactMode::slides : ContactMode::sticks;
      changed |= mode != modes_[i];
      modes_[i] = mode;
    }
    return changed;
  }

  void add_forces(const RestingContacts<double>& contacts, const double* x, std::vector<double>& f) const {
    for_each_touching(contacts, [&](std::size_t, const auto& item, ContactMode mode) {
      const auto& numbers = item.numbers;
      const Vec3<double> z = contacts.in_frame(item, x);
      const Vec3<double> force = decided(item.shape, mode, z, numbers, push(item.shape, z, numbers));
      contacts.add(item, (1.0 / RestingContacts<double>::per_force) * contacts.pose(item).turned(force), f.data());
    });
  }

  // Adds the sizes of the forces.
  void add_sizes(const RestingContacts<double>& contacts, const double* x, std::vector<double>& f) const {
    std::vector<double> own(f.size(), 0.0);
    add_forces(contacts, x, own);
    for (std::size_t i = 0; i < f.size(); ++i) f[i] += std::abs(own[i]);
  }

  // What the contacts hold by giving way  [J]
  double energy(const RestingContacts<double>& contacts, const double* x) const {
    double sum = 0.0;
    for_each_touching(contacts, [&](std::size_t, const auto& item, ContactMode) {
      const double p = push(item.shape, contacts.in_frame(item, x), item.numbers);
      sum += 0.5 * p * p / (item.numbers.kappa * RestingContacts<double>::per_force);
    });
    return sum;
  }

  // One for each item, zero where it is apart.
  std::vector<ContactBlock> blocks(const RestingContacts<double>& contacts, const double* x) const {
    std::vector<ContactBlock> all(contacts.items.size(), ContactBlock{});
    for_each_touching(contacts, [&](std::size_t i, const auto& item, ContactMode mode) {
      using D = Dual<double, 3>;
      const Contact& contact = contacts.contact(item);
      for (int k = 0; k < contact.arity; ++k) all[i].weight[k] = contacts.source->weight(contact, item.item, k);
      const Vec3<double> z = contacts.in_frame(item, x);
      D at[3] = {D(z.x), D(z.y), D(z.z)};
      for (int d = 0; d < 3; ++d) at[d].d[d] = 1.0;
      const auto numbers = constants<D>(item.numbers);
      const D pushed = push(item.shape, Vec3<D>(at), numbers);
      const auto matrix = [&](const D& limit_of, double* A) {
        D force[3];
        decided(item.shape, mode, Vec3<D>(at), numbers, limit_of).store(force);
        const double* R = contacts.pose(item).turn;
        for (int a = 0; a < 3; ++a)
          for (int b = 0; b < 3; ++b) {
            A[3 * a + b] = 0.0;
            for (int p = 0; p < 3; ++p)
              for (int q = 0; q < 3; ++q)
                A[3 * a + b] -= R[3 * a + p] * force[p].d[q] * R[3 * b + q] / RestingContacts<double>::per_force;
          }
      };
      matrix(pushed, all[i].whole);
      all[i].slides = item.rubs && mode == ContactMode::slides;
      double A[9];
      matrix(D(pushed.v), A);
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) all[i].symmetric[3 * a + b] = 0.5 * (A[3 * a + b] + A[3 * b + a]);
    });
    return all;
  }

 private:
  std::vector<ContactMode> modes_;

  template <class F>
  void for_each_touching(const RestingContacts<double>& contacts, F&& f) const {
    for (std::size_t i = 0; i < modes_.size(); ++i)
      if (modes_[i] != ContactMode::apart) f(i, contacts.items[i], modes_[i]);
  }

  template <class D>
  static D push(const AnyShape& shape, const Vec3<D>& z, const ContactNumbers<D>& c) {
    D at[3], distance, n[3];
    z.store(at);
    distance_from(shape, at, c.size, distance, n);
    return c.kappa * (c.radius - distance);
  }

  // The law's force in the collider's frame, which may pull. Coulomb's limit is that of the push `limit_of`.
  template <class D>
  static Vec3<D> decided(const AnyShape& shape, ContactMode mode, const Vec3<D>& z, const ContactNumbers<D>& c,
                         const D& limit_of) {
    D at[3], distance, own[3];
    z.store(at);
    distance_from(shape, at, c.size, distance, own);
    const Vec3<D> n(own), unit = unit_normal(shape, n), trial = c.carried - c.kappa * (z - c.from);
    const Vec3<D> force = (c.kappa * (c.radius - distance)) * n, tau = trial - dot(unit, trial) * unit;
    if (mode == ContactMode::sticks) return force + tau;
    const D squared = dot(tau, tau);
    if (value_of(c.friction) == 0.0 || value_of(squared) == 0.0) return force;
    return force + (c.friction * sqrt(dot(n, n)) * limit_of / sqrt(squared)) * tau;
  }
};

}  // namespace sheetbend
