// What the stages of a substep read, and what they hand on to each other.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/contact/collision.h"
#include "core/packs/packed_colors.h"
#include "core/points/point_kernels.h"
#include "core/scalar/point.h"
#include "core/scene/scene.h"
#include "core/solver/contact_source.h"
#include "core/solver/plan.h"
#include "core/solver/states.h"
#include "core/solver/swept_contacts.h"

namespace sheetbend {

// What a substep is given.
template <class T>
struct Step {
  const Scene& scene;
  const Plan& plan;
  Inputs<const T> in;
  Bdf bdf;
  double t_next;
  SubstepStates<T> from;          // the states at n and n-1
  Scenes scenes = all_scenes<T>;  // that are solved; the others' numbers are left over

  int threads() const { return plan.options.threads; }
};

// The effective inverse masses: w = 1/(m + eta c), of a director 1/(m eta^2), 0 for what cannot move; and with drag the share m w of its
// momentum that a particle keeps, in a wind of that relative to it.
template <class T>
struct InverseMasses {
  std::vector<T> w, kept;
  Vec3<T> wind;      // at the substep's end; zero where drag is against still air
  double eta = 0.0;  // without drag they are computed once per eta

  void resize(const Scene& scene, const Plan&, bool) {
    w.resize(scene.nodes());
    if (scene.has_drag) kept.resize(scene.nodes());
  }
  static std::size_t bytes(const Scene& scene, const Plan&, bool) {
    return sizeof(T) * (scene.has_drag ? 2 : 1) * static_cast<std::size_t>(scene.nodes());
  }
};

// A flight that an impact ended, and the one that it began.
template <class S>
struct Flown {
  int node = -1;
  int ball = -1;  // place in Scene::balls, of those that hit each other
  Flight<S> before, after;
};

// A particle that bounced in a substep, or two that hit each other, in one scene of a T.
template <class S>
struct Impact {
  int lane;
  int contact;          // -1 where two hit each other
  BallMeeting meeting;  // of one particle the time alone, since its flight began
  std::array<Flown<S>, 2> both;

  std::span<const Flown<S>> flown() const { return {both.data(), contact < 0 ? std::size_t{2} : 1}; }
};

// What the stages write for each other.
template <class T>
struct Work {
  InverseMasses<T>& masses;
  Coordinates<T> q;          // predicted, then corrected: in the rows of the kernels that sweep, otherwise in x_next
  T *x_next, *v_next;        // (dofs); the repetition for a reverse has no v_next
  bool finite = true;        // whether all of x_next is
  T* multipliers = nullptr;  // of the substep, where a later stage reads them
  const std::vector<Impact<Single<T>>>* impacts = nullptr;       // of each particle in order; none where it is null
  const std::vector<ColliderPoses<Single<T>>>* poses = nullptr;  // per scene; none where no stage asks
  std::vector<SweptContacts<Single<T>>>* swept = nullptr;        // per scene; none where no contacts go by sweeps
};

// What the contacts of a scene of T read of a substep.
template <class T>
ContactSource<T> contact_source(const Step<T>& step, const InverseMasses<T>& masses, int lane) {
  return {step.scene, step.in, step.bdf, step.t_next, step.plan.options.h, step.from, masses.w.data(), lane};
}

// now y_n + before y_{n-1}, from which a backward difference formula starts.
template <class T, class How>
typename How::Point history(const Bdf& bdf, How, const T* now, const T* before) {
  if (bdf.before == 0.0) return How::load(now);
  return scaled(bdf.now, How::load(now)) + scaled(bdf.before, How::load(before));
}

// Where what was at n and n-1 goes on to: the velocity that quadratic drag is linearized at, and a director's prediction.
template <class T>
Vec3<T> extrapolated(const Bdf& bdf, const T* now, const T* before) {
  return T(bdf.extrapolate_now) * Vec3<T>(now) + T(bdf.extrapolate_before) * Vec3<T>(before);
}

// The kernels for T: of this machine's instruction set for lanes and for duals of forward rollouts, otherwise compiled where they are used.
template <class T>
const sheetbend_points::Kernels& point_kernels() {
  if constexpr (std::is_same_v<T, Pack>)
    return pack_kernels().points->lanes;
  else if constexpr (std::is_same_v<T, Dual<double, 4>>)
    return pack_kernels().points->four_directions;
  else if constexpr (std::is_same_v<T, Dual<double, 8>>)
    return pack_kernels().points->eight_directions;
  else
    return PointKernels<T>::all;
}

// What the kernels read and write. Without `work`, the coordinates are left open.
template <class T>
sheetbend_points::Points points_of(const Step<T>& step, InverseMasses<T>& masses, const Work<T>* work = nullptr) {
  const auto read = [](const T* from) { return reinterpret_cast<const double*>(from); };
  const auto write = [](T* to) { return reinterpret_cast<double*>(to); };
  const Scene& scene = step.scene;
  sheetbend_points::Points p{};
  p.eta = step.bdf.eta;
  p.now = step.bdf.now;
  p.before = step.bdf.before;
  p.extrapolate_now = step.bdf.extrapolate_now;
  p.extrapolate_before = step.bdf.extrapolate_before;
  p.inertial = scene.inertial.data();
  p.director = scene.is_director.data();
  p.has_weight = scene.has_weight.data();
  p.x = read(step.from.x);
  p.x_before = read(step.from.x_before);
  p.v = read(step.from.v);
  p.v_before = read(step.from.v_before);
  p.mass = read(step.in.of(Quantity::mass));
  p.drag_linear = read(step.in.of(Quantity::drag_linear));
  p.drag_quadratic = read(step.in.of(Quantity::drag_quadratic));
  p.gravity = read(step.in.of(Quantity::gravity));
  p.wind = read(&masses.wind.x);
  p.w = write(masses.w.data());
  p.kept = scene.has_drag ? write(masses.kept.data()) : nullptr;
  if (!work) return p;
  p.q = write(work->q.data);
  p.stride = work->q.stride;
  p.x_next = write(work->x_next);
  p.v_next = write(work->v_next);
  return p;
}

}  // namespace sheetbend
