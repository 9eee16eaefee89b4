// A rollout: substeps from the initial state. The forward program is the same whether its states are kept (the tape) or not.
// Compiled once per scalar (adjoint/instances_*.cpp): whoever steps a rollout does not compile the solver again.
#pragma once

#include "core/scalar/complex.h"
#include "core/scalar/dual.h"
#include "core/solver/divergence.h"
#include "core/solver/interrupt.h"
#include "core/step/substep.h"

namespace sheetbend {

// T: double, Pack, Complex, Dual<double, 1>, Dual<double, 4> or Dual<double, 8>. List: the stages of a substep.
template <class T, class List = Substep>
class Rollout {
 public:
  Rollout(const Scene& scene, const Plan& plan, const T* inputs, double t0 = 0.0);
  ~Rollout();

  // Driven nodes start where their boundary is at t0, and bodies that keep their spin with that of their velocities.
  static void initial_state(const Scene& scene, const Inputs<const T>& in, double t0, T* x, T* v);

  void advance();

  // Goes on from another state, at `step`, which need not be one of this rollout's own.
  void restart(int step, const SubstepStates<T>& s);

  const T* x() const { return x_.data(); }

  // All that the next substep begins with.
  SubstepStates<T> state() const { return {x_.data(), x_before_.data(), v_.data(), v_before_.data(), step_}; }

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

  // Of the last substep, per implicit block: the force left at the start and after each Newton step, over the largest one.
  std::vector<std::vector<double>> balance() const;

  double time(int step) const { return t0_ + step * plan_.options.h; }

 private:
  void throw_diverged() const;

  const Scene& scene_;
  const Plan& plan_;
  Inputs<const T> in_;
  double t0_;
  int step_ = 0;
  std::vector<T> x_, x_before_, x_next_, v_, v_before_, v_next_;
  std::vector<T> multipliers_;
  SubstepRecord<T, List> record_;
};

template <class T, class List>
Rollout<T, List>::Rollout(const Scene& scene, const Plan& plan, const T* inputs, double t0)
    : scene_(scene), plan_(plan), in_{scene.layout, inputs}, t0_(t0) {
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
void Rollout<T, List>::advance() {
  const Bdf bdf = Bdf::at(plan_.options, step_);
  bool finite;
  try {
    const Step<T> step{scene_, plan_, in_, bdf, time(step_ + 1), state()};
    finite = substep(step, x_next_.data(), v_next_.data(), record_);
  } catch (const Unbalanced& e) {
    throw Unbalanced(e, step_ + 1, time(step_ + 1));
  }
  ++step_;
  std::swap(x_before_, x_);
  std::swap(x_, x_next_);
  std::swap(v_before_, v_);
  std::swap(v_, v_next_);
  if (!finite) throw_diverged();
}

template <class T, class List>
void Rollout<T, List>::restart(int step, const SubstepStates<T>& s) {
  step_ = step;
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
