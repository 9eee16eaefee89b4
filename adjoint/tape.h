// The tape of a rollout: the coordinates at every substep boundary. Velocities follow from them, and a substep is recomputed before it
// is reversed, so nothing inside a substep is kept.
#pragma once

#include <vector>

#include "core/solver/rollout.h"

namespace sheetbend {

template <class T>
class Tape {
 public:
  Tape(const Scene& scene, const Plan& plan, int steps) : scene_(scene), plan_(plan), steps_(steps) {
    x_.resize(static_cast<std::size_t>(steps + 1) * scene.dofs());
  }

  void record(int step, const T* x) { std::copy_n(x, scene_.dofs(), x_.data() + at(step)); }
  const T* x(int step) const { return x_.data() + at(step < 0 ? 0 : step); }
  int steps() const { return steps_; }
  std::size_t bytes() const { return x_.size() * sizeof(T); }

  // The velocity that the forward program had at `step`; v0 is the initial one.
  void velocity(int step, const T* v0, T* v) const {
    if (step <= 0) {
      std::copy_n(v0, scene_.dofs(), v);
      return;
    }
    const Bdf bdf = Bdf::at(plan_.options, step - 1);
    const T *next = x(step), *now = x(step - 1), *before = x(step - 2);
    for (int i = 0; i < scene_.dofs(); ++i) v[i] = (next[i] - history(bdf, now[i], before[i])) * T(1.0 / bdf.eta);
  }

 private:
  std::size_t at(int step) const { return static_cast<std::size_t>(step) * scene_.dofs(); }
  const Scene& scene_;
  const Plan& plan_;
  int steps_;
  std::vector<T> x_;
};

}  // namespace sheetbend
