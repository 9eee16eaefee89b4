// The tape of a rollout: the coordinates at substep boundaries, at all of them or at those that checkpoints.h keeps. Velocities follow from
// them, and a substep is recomputed before it is reversed, so nothing inside a substep is kept but its formula where that changes at contacts, and the velocities of what has
// bounced. Implicit blocks are not solved again, but known
// by where a substep ends: for them the last boundary is kept as well.
//
// A reverse writes to a tape that dropped boundaries, so such reverses wait for each other; a whole tape is only read, by any number at a time.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <vector>

#include "adjoint/tape/checkpoints.h"
#include "core/rollout/rollout.h"

namespace sheetbend {

template <class T>
class Tape {
 public:
  // `states` boundaries fit, at least Schedule::least; more than `steps` are never needed.
  Tape(const Scene& scene, const Plan& plan, int steps, int states)
      : scene_(scene), plan_(plan), steps_(steps), states_(std::min(states, std::max(1, steps))), slot_(steps + 1, -1) {
    if (changes_at_contacts(scene, plan.options)) first_order_.resize(std::max(1, steps));
    x_.resize(static_cast<std::size_t>(states_ + ends(plan)) * scene.dofs());
    if (ends(plan)) slot_[steps] = states_;
    for (int slot = states_; slot-- > 0;) spare_.push_back(slot);
  }

  // Boundaries whose coordinates a restart needs: the velocities at n and n-1 are read off them.
  static int window(const Plan& plan) { return plan.options.integrator == Integrator::bdf1 ? 2 : 4; }

  // States that are kept beside those of the schedule.
  static int ends(const Plan& plan) { return plan.options.partition == Partition::implicit ? 1 : 0; }
  bool keeps_end() const { return ends(plan_) > 0; }

  Schedule schedule() const { return {steps_, states_, window(plan_)}; }
  int steps() const { return steps_; }
  int states() const { return states_; }
  std::size_t bytes() const { return x_.size() * sizeof(T) + first_order_.size(); }
  long recomputed() const { return recomputed_; }  // substeps that the last reverse advanced again
  void count_recomputed(long substeps) { recomputed_ = substeps; }

  // Held by a reverse for as long as it uses the tape. Waiting can be interrupted. By the system's clock, since the thread sanitizer of gcc 12 does
  // not see locks that wait by the steady one.
  std::unique_lock<std::timed_mutex> turn(Interrupt* interrupt) {
    if (states_ >= steps_) return {};
    std::unique_lock lock(*mutex_, std::defer_lock);
    while (!lock.try_lock_until(std::chrono::system_clock::now() + std::chrono::milliseconds(50)))
      if (interrupt) interrupt->poll();
    return lock;
  }

  void record(int step, const T* x) {
    if (slot_[step] < 0) {
      if (spare_.empty()) throw std::logic_error("the tape is full");
      slot_[step] = spare_.back();
      spare_.pop_back();
    }
    for_each_dof([&, to = at(step)](int begin, int end) { std::copy(x + begin, x + end, to + begin); });
  }
  // The scenes that went with BDF1 in the substep from `step` to the next, where the formula changes at contacts: kept for all of them.
  void record_first_order(int step, Scenes scenes) {
    if (!first_order_.empty()) first_order_[step] = scenes;
  }
  Scenes first_order(int step) const {
    if (!first_order_.empty()) return first_order_[step];
    return Bdf::at(plan_.options, step).before == 0.0 ? all_scenes<T> : Scenes{0};
  }
  // The particles that have bounced in the substep to `step`: kept for all of them.
  void record_bounced(int step, const std::vector<Bounced<T>>& bounced) {
    if (!bounced.empty()) bounced_[step] = bounced;
  }
  bool holds(int first, int last) const {
    return std::all_of(slot_.begin() + first, slot_.begin() + last + 1, [](int slot) { return slot >= 0; });
  }
  void forget_after(int step) {
    for (auto slot = slot_.begin() + step + 1; slot != slot_.end() - ends(plan_); ++slot)
      if (*slot >= 0) spare_.push_back(std::exchange(*slot, -1));
  }

  // Coordinates at `step`; before the start they are the initial ones.
  const T* x(int step) const { return x_.data() + offset(step < 0 ? 0 : step); }

  // The velocity that the forward program had at `step`; v0 is the initial one.
  void velocity(int step, const T* v0, T* v) const {
    if (step <= 0) {
      for_each_dof([&](int begin, int end) { std::copy(v0 + begin, v0 + end, v + begin); });
      return;
    }
    const Scenes first = first_order(step - 1);
    const Bdf bdf = Bdf::second_order(plan_.options.h);
    const T *next = x(step), *now = x(step - 1), *before = first == all_scenes<T> ? now : x(step - 2);
    const T first_rate(1.0 / plan_.options.h), rate(1.0 / bdf.eta), weight_now(bdf.now), weight_before(bdf.before);
    const auto by_first = [=](int i) { return (next[i] - now[i]) * first_rate; };
    const auto by_second = [=](int i) { return (next[i] - (weight_now * now[i] + weight_before * before[i])) * rate; };
    for_each_dof([=](int begin, int end) {
      if (first == all_scenes<T>)
        for (int i = begin; i < end; ++i) v[i] = by_first(i);
      else if (first == 0)
        for (int i = begin; i < end; ++i) v[i] = by_second(i);
      else
        for (int i = begin; i < end; ++i) v[i] = chosen(first, by_first(i), by_second(i));
    });
    const auto bounced = bounced_.find(step);
    if (bounced == bounced_.end()) return;
    for (const Bounced<T>& b : bounced->second) {
      T own[3];
      b.v.store(own);
      for (int d = 0, i = scene_.first_dof[b.node]; d < 3; ++d, ++i) v[i] = chosen(b.scenes, own[d], v[i]);
    }
  }

 private:
  template <class F>
  void for_each_dof(F&& f) const {
    parallel_for(scene_.dofs(), plan_.options.threads, 3 * points_per_thread, f);
  }
  std::size_t offset(int step) const { return static_cast<std::size_t>(slot_[step]) * scene_.dofs(); }
  T* at(int step) { return x_.data() + offset(step); }

  const Scene& scene_;
  const Plan& plan_;
  int steps_, states_;
  long recomputed_ = 0;
  std::unique_ptr<std::timed_mutex> mutex_ = std::make_unique<std::timed_mutex>();  // apart, so that tapes can be moved
  std::vector<int> slot_, spare_;  // per boundary where it stands in x_, or -1
  std::vector<T> x_;
  std::vector<Scenes> first_order_;                 // per substep
  std::map<int, std::vector<Bounced<T>>> bounced_;  // by the boundary at which a substep with bounces ends
};

}  // namespace sheetbend
