// The reverses of stages (core/step/stages.h). ReverseOf<S> is a struct with
//
//   template <class T> using Scratch                  what it works on, and what gathers over substeps
//     void resize(scene, plan)
//     static std::size_t bytes(scene, plan)           that resize() allocates, the Scratch itself left out
//   template <class T> static void run(const Step<T>&, const Work<T>&, S::Record<T>&, Scratch<T>&, const StepCotangents<T>&)
//   template <class T> static void finish(...)        where something gathered: adds it to the inputs' cotangents, see sweep_colors.h
//
// Reverses run in the opposite order of their stages, on what the repeated stages have left in Work and Record.
#pragma once

#include "adjoint/solver/cotangents.h"
#include "core/step/stages.h"

namespace sheetbend {

template <class S>
struct ReverseOf;

template <class S>
struct SweptContactCotangents;  // adjoint/solver/swept_contacts_vjp.h

// What the reverses hand on to each other.
template <class T>
struct StepCotangents {
  T* x_next;                 // of x_next (dofs); used up
  const T* v_next;           // of v_next (dofs)
  Coordinates<T> q;          // of the coordinates while they are corrected; those of x_next and v_next end here
  T* w;                      // of the effective inverse masses, accumulated
  T* kept;                   // of InverseMasses::kept, of what has inertia
  T* w_of_forces;            // per loaded particle, of its w as the forces see it: added to mass and drag after `w`
  StateCotangents<T> from;   // of the states at n and n-1, added to
  Inputs<T> in;              // of the inputs, added to
  T* multipliers = nullptr;  // of Work::multipliers
  std::vector<SweptContactCotangents<Single<T>>>* swept = nullptr;  // of Work::swept
};

// Reverse of history().
template <class T, class How>
void pull_back_history(const Bdf& bdf, How, const typename How::Point& bar, T* now_bar, T* before_bar) {
  if (bdf.before == 0.0) return How::add(now_bar, bar);
  How::add(now_bar, scaled(T(bdf.now), bar));
  How::add(before_bar, scaled(T(bdf.before), bar));
}

// Reverse of extrapolated().
template <class T>
void pull_back_extrapolated(const Bdf& bdf, const Vec3<T>& bar, T* now_bar, T* before_bar) {
  (T(bdf.extrapolate_now) * bar).add_to(now_bar);
  if (bdf.extrapolate_before != 0.0) (T(bdf.extrapolate_before) * bar).add_to(before_bar);
}

// Reverse of at_knots().
template <class T>
void pull_back_knots(const KnotWeights& k, const Vec3<T>& bar, T* values_bar, int slots, int slot) {
  for (int i = 0; i < k.count; ++i)
    (T(k.weight[i]) * bar).add_to(values_bar + 3 * ((static_cast<std::size_t>(k.first) + i) * slots + slot));
}

// The scratch of all stages of a list.
template <class S, class T>
struct ScratchOf {
  typename ReverseOf<S>::template Scratch<T> scratch;
};

template <class T, class List>
struct Scratches;

template <class T, class... S>
struct Scratches<T, Stages<S...>> : private ScratchOf<S, T>... {
  Scratches(const Scene& scene, const Plan& plan) { (of<S>().resize(scene, plan), ...); }
  template <class Stage>
  auto& of() {
    return static_cast<ScratchOf<Stage, T>&>(*this).scratch;
  }
  static std::size_t bytes(const Scene& scene, const Plan& plan) {
    return (std::size_t{0} + ... + ReverseOf<S>::template Scratch<T>::bytes(scene, plan));
  }
};

}  // namespace sheetbend
