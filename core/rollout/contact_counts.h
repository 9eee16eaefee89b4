// What the contacts of a scene did in a rollout, counted over its substeps.
#pragma once

#include <algorithm>
#include <vector>

#include "core/step/carry_friction.h"

namespace sheetbend {

// Of one contact. A particle that touches in the first substep has not begun to; one that bounces begins and ends. Of what touches itself with friction the
// same of pairs, and how often balls hit each other.
struct ContactCounts {
  int most = 0;                    // particles that touched at once
  int began = 0, ended = 0;        // how often one did
  long touching = 0, sliding = 0;  // particles, summed over substeps
};

class CountContacts {
 public:
  explicit CountContacts(const Scene& scene) : scene_(scene), counts_(scene.contacts.size()) {}

  // After each substep of a rollout.
  template <class R>
  void look(const R& rollout) {
    const std::vector<ContactMode>& modes = rollout.contact_modes();
    for (const auto& impact : rollout.impacts()) {
      ContactCounts& count = impact.contact < 0 ? balls_ : counts_[impact.contact];
      ++count.began;
      ++count.ended;
    }
    const bool first = before_.empty();
    for (std::size_t c = 0; c < counts_.size(); ++c) {
      const std::size_t begin = scene_.contacts[c].first, end = begin + scene_.contacts[c].carried.size();
      ContactCounts& count = counts_[c];
      int touching = 0;
      for (std::size_t i = begin; i < end; ++i) {
        const bool touches = modes[i] != ContactMode::apart;
        touching += touches;
        count.sliding += modes[i] == ContactMode::slides;
        if (first) continue;
        const bool touched = before_[i] != ContactMode::apart;
        count.began += touches && !touched;
        count.ended += touched && !touches;
      }
      count.touching += touching;
      count.most = std::max(count.most, touching);
    }
    before_ = modes;
    look_at_pairs(rollout.x());
  }

  const std::vector<ContactCounts>& counts() const { return counts_; }
  const ContactCounts& pairs() const { return pairs_; }
  const ContactCounts& balls() const { return balls_; }

 private:
  // They are in the state, in the order of keys.
  void look_at_pairs(const double* x) {
    std::vector<PairKey> now;
    for (const auto& [key, force] : scene_.self_contact.carried) {
      const double* code = x + scene_.first_dof[key];
      if (!is_coded(code[0])) break;
      now.push_back(decoded(code[0], code[1], code[2]));
      pairs_.sliding += slides_of(code[0]);
    }
    pairs_.touching += static_cast<long>(now.size());
    pairs_.most = std::max(pairs_.most, static_cast<int>(now.size()));
    const auto new_of = [](const std::vector<PairKey>& all, const std::vector<PairKey>& old) {
      return std::ranges::count_if(all, [&](const PairKey& k) { return !std::ranges::binary_search(old, k); });
    };
    if (looked_) {
      pairs_.began += static_cast<int>(new_of(now, touched_));
      pairs_.ended += static_cast<int>(new_of(touched_, now));
    }
    looked_ = true;
    touched_ = std::move(now);
  }

  const Scene& scene_;
  std::vector<ContactCounts> counts_;
  std::vector<ContactMode> before_;
  ContactCounts pairs_, balls_;
  std::vector<PairKey> touched_;
  bool looked_ = false;
};

}  // namespace sheetbend
