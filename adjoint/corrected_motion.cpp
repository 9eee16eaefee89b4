#include "adjoint/corrected_motion.h"

#include <numeric>

#include "adjoint/equilibrium_vjp.h"
#include "adjoint/observation.h"
#include "core/scalar/dual.h"

namespace sheetbend {
namespace {

using Eight = Dual<double, 8>;

// A marker on its own nodes: its position depends on 12 numbers.
Marker on_own_nodes(const Marker& m) {
  Marker own = m;
  own.dof = {0, 3, 6, 9};
  return own;
}

// x_bar (dofs) += the gradient of half the sum of squared residuals of one frame.
void pull_back_frame(const Observations& o, std::size_t frame, const double* x, const double* offsets, double* x_bar) {
  using D = Dual<double, 12>;
  for (std::size_t m = 0; m < o.markers.size(); ++m) {
    const std::size_t at = frame * o.markers.size() + m;
    if (!is_seen(o, at)) continue;
    const Marker& marker = o.markers[m];
    D own[12], r[3];
    for (int i = 0; i < 12; ++i) {
      own[i].v = x[marker.dof[i / 3] + i % 3];
      own[i].d[i] = 1.0;
    }
    const D offset[3] = {offsets[3 * m], offsets[3 * m + 1], offsets[3 * m + 2]};
    marker_residuals(o, at, marker_position(on_own_nodes(marker), own, offset), r);
    for (int i = 0; i < 12; ++i)
      for (const D& one : r) x_bar[marker.dof[i / 3] + i % 3] += one.v * one.d[i];
  }
}

}  // namespace

CorrectedMotion::CorrectedMotion(const Experiment& e, const double* theta, const double* b, Interrupt* interrupt)
    : e_(e), last_(e.steps()), inputs_(e.inputs_at(theta, b)), start_(inputs_), residuals_(e.residual_count()) {
  const Scene& scene = *e.scene;
  const std::size_t dofs = scene.dofs();
  if (e.start == Start::equilibrium) {
    rest_ = e.anchor->solve(scene, inputs_.data(), e.equilibrium, interrupt);
    std::copy(rest_->x.begin(), rest_->x.end(), &start_[scene.layout.of(Quantity::position)]);
  }
  std::vector<int> every(last_ + 1);
  std::iota(every.begin(), every.end(), 0);
  states_.resize(every.size() * dofs);
  tape_.emplace(record_rollout(scene, e.plan, start_.data(), e.t0, every, states_.data(), every_state, interrupt));

  const double* offsets = &inputs_[scene.layout.total()];
  std::vector<double> x(dofs);
  double* r = residuals_.data();
  for (std::size_t f = 0; f < e.observed.times.size(); ++f) {
    first_row_.push_back(r - residuals_.data());
    const FramePlace<double> place(e, f, inputs_.back(), last_);
    place.interpolate(dofs, [&](int k) { return &states_[(place.base - 1 + k) * dofs]; }, x.data());
    r = frame_residuals(e.observed, f, x.data(), offsets, r, static_cast<double*>(nullptr));
  }
}

std::vector<double> CorrectedMotion::gradient(Interrupt* interrupt) {
  const Scene& scene = *e_.scene;
  const std::size_t dofs = scene.dofs();
  std::vector<double> x_bar(states_.size()), x(dofs), frame_bar(dofs), inputs_bar(scene.layout.total());
  for (std::size_t f = 0; f < e_.observed.times.size(); ++f) {
    const FramePlace<double> place(e_, f, inputs_.back(), last_);
    const std::size_t first = (place.base - 1) * dofs;
    place.interpolate(dofs, [&](int k) { return &states_[first + k * dofs]; }, x.data());
    std::fill(frame_bar.begin(), frame_bar.end(), 0.0);
    pull_back_frame(e_.observed, f, x.data(), &inputs_[scene.layout.total()], frame_bar.data());
    for (int k = 0; k < 4; ++k)
      for (std::size_t i = 0; i < dofs; ++i) x_bar[first + k * dofs + i] += place.weight[k] * frame_bar[i];
  }
  std::vector<int> every(last_ + 1);
  std::iota(every.begin(), every.end(), 0);
  reverse_rollout(scene, e_.plan, start_.data(), e_.t0, *tape_, every, x_bar.data(), inputs_bar.data(), interrupt);
  if (rest_) {
    const auto at = inputs_bar.begin() + static_cast<std::ptrdiff_t>(scene.layout.of(Quantity::position));
    const std::vector<double> rest_bar(at, at + static_cast<std::ptrdiff_t>(dofs));
    EquilibriumDerivative(scene, inputs_.data(), *rest_).vjp(rest_bar.data(), nullptr, inputs_bar.data());
  }
  std::vector<double> b_bar(e_.correction.count());
  e_.correction.pull_back(inputs_bar.data(), b_bar.data());
  return b_bar;
}

// The substep that an unknown begins to move: the first one after its earliest knot's support begins; 0 where it moves the start.
int CorrectedMotion::first_step(int unknown) const {
  const Scene& scene = *e_.scene;
  const BoundaryCorrection& c = e_.correction;
  int first = std::numeric_limits<int>::max();
  for (int k = c.first[unknown]; k < c.first[unknown + 1]; ++k) first = std::min(first, c.target[k]);
  const int per_knot = 3 * static_cast<int>(scene.driven.size());
  const int knot = (first - static_cast<int>(scene.layout.of(Quantity::boundary))) / per_knot;
  if (knot == 0) return 0;
  const int reach = scene.boundary.interpolation == Interpolation::cubic ? 2 : 1;
  const double begins = scene.boundary.times[std::max(knot - reach, 0)];
  return std::max(0, static_cast<int>(std::floor((begins - e_.t0) / e_.plan.options.h + 1e-9)) + 1);
}

void CorrectedMotion::columns(int first, int width, double* columns, Interrupt* interrupt) const {
  const Scene& scene = *e_.scene;
  const std::size_t dofs = scene.dofs(), rows = residuals_.size();
  int moved = last_;
  for (int k = 0; k < width; ++k) moved = std::min(moved, first_step(first + k));
  const int from = std::max(0, moved - 3);  // so that every frame that is moved has its four states
  std::vector<Eight> b(e_.correction.count()), in;
  for (int k = 0; k < width; ++k) b[first + k].d[k] = 1.0;
  in.assign((from == 0 ? inputs_ : start_).begin(), (from == 0 ? inputs_ : start_).end());
  e_.correction.apply(b.data(), in.data());  // of value zero: the inputs are corrected already
  if (from == 0 && rest_) {
    const auto x = equilibrium_coordinates<Eight>(scene, in.data(), e_.equilibrium, *e_.anchor, interrupt);
    std::copy(x.begin(), x.end(), &in[scene.layout.of(Quantity::position)]);
  }
  Rollout<Eight> rollout(scene, e_.plan, in.data(), e_.t0);
  if (from > 0) {
    std::vector<double> v(dofs), v_before(dofs);
    const double* v0 = &start_[scene.layout.of(Quantity::velocity)];
    tape_->velocity(from, v0, v.data());
    tape_->velocity(from - 1, v0, v_before.data());
    const auto duals = [&](const double* a) { return std::vector<Eight>(a, a + dofs); };
    const auto x = duals(&states_[from * dofs]), x_before = duals(&states_[(from - 1) * dofs]);
    const auto u = duals(v.data()), u_before = duals(v_before.data());
    rollout.restart(from, {x.data(), x_before.data(), u.data(), u_before.data(), from});
  }

  for (int k = 0; k < width; ++k) std::fill_n(columns + k * rows, rows, 0.0);
  const std::vector<Eight> offsets(inputs_.begin() + static_cast<std::ptrdiff_t>(scene.layout.total()), inputs_.end());
  std::vector<Eight> ring(4 * dofs), x(dofs), r(3 * e_.observed.markers.size());
  std::size_t next = 0;
  const auto place_of = [&] { return FramePlace<Eight>(e_, next, Eight(inputs_.back()), last_); };
  while (next < first_row_.size() && place_of().base - 1 < from) ++next;
  const auto keep = [&](int step) {
    std::copy_n(rollout.x(), dofs, &ring[(step % 4) * dofs]);
    for (; next < first_row_.size(); ++next) {
      const FramePlace<Eight> place = place_of();
      if (step < place.base + 2) return;
      place.interpolate(dofs, [&](int k) { return &ring[((place.base - 1 + k) % 4) * dofs]; }, x.data());
      const Eight* end =
          frame_residuals(e_.observed, next, x.data(), offsets.data(), r.data(), static_cast<Eight*>(nullptr));
      for (int k = 0; k < width; ++k)
        for (std::ptrdiff_t i = 0; i < end - r.data(); ++i) columns[k * rows + first_row_[next] + i] = r[i].d[k];
    }
  };
  keep(from);
  for (int step = from + 1; step <= last_ && next < first_row_.size(); ++step) {
    poll(interrupt, step, scene.dofs());
    rollout.advance();
    keep(step);
  }
}

}  // namespace sheetbend
