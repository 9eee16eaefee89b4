// A rollout: substeps from the initial state. The forward program is the same whether its states are kept (the tape) or not.
// Compiled once per scalar (adjoint/rollout/instances_*.cpp): whoever steps a rollout does not compile the solver again.
#pragma once

#include <optional>

#include "core/scalar/complex.h"
#include "core/scalar/dual.h"
#include "core/solver/divergence.h"
#include "core/solver/interrupt.h"
#include "core/step/contact_begins.h"
#include "core/step/substep.h"

namespace sheetbend {

// The velocity of a particle that has bounced, in these scenes.
template <class T>
struct Bounced {
  int node;
  Scenes scenes;
  Vec3<T> v;
};

// T: double, Pack, Complex, Dual<double, 1>, Dual<double, 4> or Dual<double, 8>. List: the stages of a substep.
template <class T, class List = Substep>
class Rollout {
 public:
  Rollout(const Scene& scene, const Plan& plan, const T* inputs, double t0 = 0.0);
  ~Rollout();

  // Driven nodes start where their boundary is at t0, and bodies that keep their spin with that of their velocities.
  static void initial_state(const Scene& scene, const Inputs<const T>& in, double t0, T* x, T* v);

  // The next substep. Where the scene's formula changes at contacts, it goes with BDF1 in the scenes `first_order`, if these are known, otherwise where a
  // contact begins or has just begun.
  void advance(std::optional<Scenes> first_order = {});

  // Goes on from another state, at `step`, which need not be one of this rollout's own.
  void restart(int step, const SubstepStates<T>& s);

  const T* x() const { return x_.data(); }

  // All that the next substep begins with.
  SubstepStates<T> state() const {
    return {x_.data(), x_before_.data(), v_.data(), v_before_.data(), step_, nullptr, after_impact_};
  }

  // Calls sink(step, x, v) for the initial state and after every substep. Throws Diverged, also for a finite state that means nothing.
  template <class Sink>
  void run(int steps, Sink&& sink, Interrupt* interrupt = nullptr) {
    Watch<T> watch(scene_, plan_.options, in_, t0_, x_.data());
    sink(0, x_.data(), v_.data());
    for (int n = 0; n < steps; ++n) {
      poll(interrupt, n, scene_.dofs());
      advance();
      if (step_ % Watch<T>::every == 0 || n + 1 == steps) watch.look(step_, time(step_), x_.data(), v_.data());
      sink(step_, x_.data(), v_.data());
    }
  }

  // The last substep's multipliers (scene.multipliers()); zero before the first.
  const T* multipliers();

  // The scenes whose last substep went with BDF1, and the formula of a rollout of one scene in it.
  Scenes first_order() const { return first_order_; }
  const Bdf& bdf() const { return bdf_; }

  // What the last substep left each particle of each contact with (of a pack: scene after scene).
  const std::vector<ContactMode>& contact_modes() const { return record_.template of<CarryFriction>().modes; }

  // How particles bounced in the last substep.
  const std::vector<Impact<Single<T>>>& impacts() const { return record_.template of<Bounce>().impacts; }

  // The particles that have bounced in the last substep, with their velocities, which positions do not tell.
  const std::vector<Bounced<T>>& bounced() const { return bounced_; }

  // Of the last substep, per implicit block: the force left at the start and after each Newton step, over the largest one.
  std::vector<std::vector<double>> balance() const;

  double time(int step) const { return t0_ + step * plan_.options.h; }

 private:
  bool take(const Bdf& bdf, Scenes scenes);
  Scenes find_bounced();
  Scenes where_pairs_begin(Scenes scenes);
  void throw_diverged() const;

  const Scene& scene_;
  const Plan& plan_;
  Inputs<const T> in_;
  double t0_;
  int step_ = 0;
  AfterImpact<T> after_impact_;
  Scenes first_order_ = 0;
  Bdf bdf_;
  std::vector<Bounced<T>> bounced_;
  std::vector<T> x_, x_before_, x_next_, v_, v_before_, v_next_;
  std::vector<T> multipliers_;
  SubstepRecord<T, List> record_;
};

template <class T, class List>
Rollout<T, List>::Rollout(const Scene& scene, const Plan& plan, const T* inputs, double t0)
    : scene_(scene), plan_(plan), in_{scene.layout, inputs}, t0_(t0), bdf_(Bdf::at(plan.options, 0)) {
  for (auto* buffer : {&x_, &x_before_, &x_next_, &v_, &v_before_, &v_next_}) buffer->resize(scene.dofs());
  record_.resize(scene, plan, false);
  initial_state(scene, in_, t0, x_.data(), v_.data());
  x_before_ = x_;
  v_before_ = v_;
}

template <class T, class List>
Rollout<T, List>::~Rollout() = default;

template <class T, class List>
void Rollout<T, List>::initial_state(const Scene& scene, const Inputs<const T>& in, double t0, T* x, T* v) {
  std::copy_n(in.of(Quantity::position), scene.dofs(), x);
  std::copy_n(in.of(Quantity::velocity), scene.dofs(), v);
  start_spins(scene, in.of(Quantity::mass), x, v);
  if (scene.driven.empty()) return;
  const KnotWeights k = scene.boundary.at(t0);
  for (std::size_t i = 0; i < scene.driven.size(); ++i)
    at_knots(k, in.of(Quantity::boundary), static_cast<int>(scene.driven.size()), static_cast<int>(i))
        .store(x + scene.first_dof[scene.driven[i]]);
}

template <class T, class List>
bool Rollout<T, List>::take(const Bdf& bdf, Scenes scenes) {
  bdf_ = bdf;
  try {
    const Step<T> step{scene_, plan_, in_, bdf, time(step_ + 1), state(), scenes};
    return substep(step, x_next_.data(), v_next_.data(), record_);
  } catch (const Unbalanced& e) {
    throw Unbalanced(e, step_ + 1, time(step_ + 1));
  }
}

template <class T, class List>
void Rollout<T, List>::advance(std::optional<Scenes> first_order) {
  const SolverOptions& o = plan_.options;
  const bool watches = changes_at_contacts(scene_, o) && !first_order;
  const auto begins = [&](Scenes scenes) -> Scenes {
    if (!watches) return 0;
    const Step<T> step{scene_, plan_, in_, bdf_, time(step_ + 1), state(), scenes};
    const auto& masses = record_.template of<ComputeEffectiveMasses>();
    const auto& swept = record_.template of<SweepColors>().contacts;
    const auto& poses = record_.template of<PlaceColliders>().scenes;
    return where_contact_begins(step, masses, poses, x_next_.data(), swept) | where_pairs_begin(scenes) |
           where_held_balls_hit(step, impacts());
  };
  constexpr Scenes all = all_scenes<T>;
  Scenes first = o.integrator == Integrator::bdf1 || step_ == 0 ? all : first_order.value_or(after_impact_.scenes());
  Scenes begun = 0;
  bool finite = true;
  if (first != all) {
    const Scenes second = all ^ first;
    finite = take(Bdf::second_order(o.h), second);
    begun = begins(second);
    first |= begun;
  }
  if (first == all) {
    finite = take(Bdf::first_order(o.h), all);
  } else if (first != 0) {
    const std::vector<T> x = x_next_, v = v_next_;
    finite = take(Bdf::first_order(o.h), first) && finite;
    for (std::size_t i = 0; i < x.size(); ++i) {
      x_next_[i] = chosen(first, x_next_[i], x[i]);
      v_next_[i] = chosen(first, v_next_[i], v[i]);
    }
  }
  const Scenes bounced = find_bounced();
  if (watches) after_impact_.count(begun | begins(first), bounced);
  first_order_ = first;
  ++step_;
  std::swap(x_before_, x_);
  std::swap(x_, x_next_);
  std::swap(v_before_, v_);
  std::swap(v_, v_next_);
  if (!finite) throw_diverged();
}

// Of some scenes, in the substep that was taken last: those where two come to touch that did not.
template <class T, class List>
Scenes Rollout<T, List>::where_pairs_begin(Scenes scenes) {
  Scenes begun = 0;
  for (BlockState<T>& block : record_.template of<ProjectBlocks>().blocks)
    for (int lane = 0; lane < static_cast<int>(block.implicit.size()); ++lane)
      if (has(scenes, lane) && block.implicit[lane].pair_begins()) begun |= static_cast<Scenes>(1u << lane);
  return begun;
}

// Of the last substep; returns the scenes in which some have.
template <class T, class List>
Scenes Rollout<T, List>::find_bounced() {
  Scenes scenes = 0;
  bounced_.clear();
  for (const auto& impact : impacts()) {
    const auto own = static_cast<Scenes>(1u << impact.lane);
    scenes |= own;
    for (const auto& f : impact.flown()) {
      auto known = std::find_if(bounced_.begin(), bounced_.end(), [&](const auto& b) { return b.node == f.node; });
      if (known == bounced_.end())
        known = bounced_.insert(known, {f.node, 0, Vec3<T>(v_next_.data() + scene_.first_dof[f.node])});
      known->scenes |= own;
    }
  }
  return scenes;
}

template <class T, class List>
void Rollout<T, List>::restart(int step, const SubstepStates<T>& s) {
  step_ = step;
  after_impact_ = s.after_impact;
  std::copy_n(s.x, x_.size(), x_.data());
  std::copy_n(s.x_before, x_.size(), x_before_.data());
  std::copy_n(s.v, v_.size(), v_.data());
  std::copy_n(s.v_before, v_.size(), v_before_.data());
  for (BlockState<T>& block : record_.template of<ProjectBlocks>().blocks) block.now.step = block.before.step = -1;
}

template <class T, class List>
const T* Rollout<T, List>::multipliers() {
  multipliers_.resize(scene_.multipliers());
  SweepColors::multipliers(scene_, plan_, record_.template of<SweepColors>(), multipliers_.data());
  ProjectBlocks::multipliers(scene_, plan_, in_, record_.template of<ProjectBlocks>(), multipliers_.data());
  return multipliers_.data();
}

template <class T, class List>
std::vector<std::vector<double>> Rollout<T, List>::balance() const {
  std::vector<std::vector<double>> all;
  for (const BlockState<T>& block : record_.template of<ProjectBlocks>().blocks)
    for (const ImplicitBlock& scene : block.implicit) all.push_back(scene.balance());
  return all;
}

template <class T, class List>
void Rollout<T, List>::throw_diverged() const {
  for (int n = 0; n < scene_.nodes(); ++n)
    for (int d = 0; d < scene_.dim[n]; ++d)
      if (!all_finite(x_[scene_.first_dof[n] + d])) throw Diverged(step_, n, time(step_));
}

extern template class Rollout<double>;
extern template class Rollout<Pack>;
extern template class Rollout<Complex>;
extern template class Rollout<Dual<double, 1>>;
extern template class Rollout<Dual<double, 4>>;
extern template class Rollout<Dual<double, 8>>;

}  // namespace sheetbend
