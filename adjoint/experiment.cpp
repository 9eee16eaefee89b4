#include "adjoint/experiment.h"

#include <algorithm>
#include <cmath>

#include "adjoint/observation.h"
#include "core/scalar/dual.h"

namespace sheetbend {

std::size_t Experiment::residual_count() const {
  std::size_t seen = 0;
  for (std::size_t i = 0; i < observed.measured.size(); i += 3) seen += !std::isnan(observed.measured[i]);
  return observed.axes.size() * seen;
}

int Experiment::steps(const Plan& run) const {
  if (is_static) return 0;
  return std::max(3, static_cast<int>(std::ceil((observed.times.back() - t0) / run.options.h - 1e-9)) + 1);
}

void Experiment::check() const {
  const std::size_t frames = observed.times.size(), markers = observed.markers.size();
  if (frames == 0 || markers == 0)
    throw std::invalid_argument(name + ": nothing is observed. Fix: give frames and markers");
  if (observed.measured.size() != 3 * frames * markers || observed.sigma.size() != frames * markers)
    throw std::invalid_argument(name + ": measured and sigma must be (frames, markers, 3) and (frames, markers)");
  if (is_static && frames != 1)
    throw std::invalid_argument(name + ": an equilibrium has one frame. Fix: give each shape as a recording");
  if (least.size() != most.size() || (!least.empty() && least.size() != scene->layout.total()))
    throw std::invalid_argument(name + ": the ranges do not fit the scene");
  if (map.base.size() != inputs()) throw std::invalid_argument(name + ": the parameter map does not fit the scene");
  if (correction.first.size() != correction.given.size() + 1)
    throw std::invalid_argument(name + ": the correction does not fit its own numbers");
  if (residual_count() == 0) throw std::invalid_argument(name + ": every marker is missing in every frame");
  if (!finer.empty() && correction.unknowns() > 0)
    throw std::invalid_argument(name +
                                ": driven markers are not corrected under extrapolation in time. Fix: leave out one");
}

template <class T, class Frame>
void Experiment::run(const Plan& own, const T* in, Frame&& frame, Interrupt* interrupt) const {
  const T time_offset = in[inputs() - 1];
  const int last = steps(own);
  const std::size_t dofs = scene->dofs();
  std::vector<T> ring(4 * dofs), x(dofs);
  std::size_t next_frame = 0;
  Rollout<T> rollout(*scene, own, in, t0);
  rollout.run(
      last,
      [&](int step, const T* state, const T*) {
        std::copy_n(state, dofs, &ring[(step % 4) * dofs]);
        for (; next_frame < observed.times.size(); ++next_frame) {
          const FramePlace<T> place(*this, own, next_frame, time_offset, last);
          if (step < place.base + 2) return;
          place.interpolate(dofs, [&](int k) { return &ring[((place.base - 1 + k) % 4) * dofs]; }, x.data());
          frame(next_frame, x.data());
        }
      },
      interrupt);
}

template <class T>
std::vector<T> Experiment::extrapolated(const T* in, Interrupt* interrupt) const {
  const T* offsets = &in[scene->layout.total()];
  std::vector<T> markers(observed.measured.size(), T(0.0)), one(markers.size());
  const auto add = [&](const Plan& own, double weight) {
    run(
        own, in,
        [&](std::size_t f, const T* x) {
          frame_residuals(observed, f, x, offsets, static_cast<T*>(nullptr), one.data());
        },
        interrupt);
    for (std::size_t i = 0; i < markers.size(); ++i) markers[i] += T(weight) * one[i];
  };
  double rest = 1.0;
  for (const FinerRun& one_more : finer) rest -= one_more.weight;
  add(plan, rest);
  for (const FinerRun& one_more : finer) add(one_more.plan, one_more.weight);
  return markers;
}

void Experiment::refuse(std::size_t input, double value) const {
  int q = 0;
  while (input >= scene->layout.offset[q + 1]) ++q;
  throw OutOfDomain(std::string(quantity_names[q]) + ": entry " + std::to_string(input - scene->layout.offset[q]) +
                    " would be " + std::to_string(value) +
                    ". Fix: bound the parameters that it is made from, or start elsewhere");
}

template <class T>
void Experiment::residuals(const T* theta, const T* b, T* r, T* simulated, Interrupt* interrupt) const {
  std::vector<T> in = inputs_at(theta, b);
  const T* offsets = &in[scene->layout.total()];
  if (is_static || start == Start::equilibrium) {
    const std::vector<T> x = equilibrium_coordinates<T>(*scene, in.data(), equilibrium, *anchor, interrupt);
    if (is_static) {
      frame_residuals(observed, 0, x.data(), offsets, r, simulated);
      return;
    }
    std::copy(x.begin(), x.end(), in.begin() + static_cast<std::ptrdiff_t>(scene->layout.of(Quantity::position)));
  }

  if (finer.empty()) {
    run(
        plan, in.data(),
        [&](std::size_t f, const T* x) { r = frame_residuals(observed, f, x, offsets, r, simulated); }, interrupt);
    return;
  }
  const std::vector<T> markers = extrapolated(in.data(), interrupt);
  if (simulated) std::copy(markers.begin(), markers.end(), simulated);
  for (std::size_t at = 0; r && at < markers.size() / 3; ++at)
    if (is_seen(observed, at)) r = marker_residuals(observed, at, Vec3<T>(&markers[3 * at]), r);
}

template void Experiment::residuals<double>(const double*, const double*, double*, double*, Interrupt*) const;
template void Experiment::residuals<Dual<double, 4>>(const Dual<double, 4>*, const Dual<double, 4>*, Dual<double, 4>*,
                                                     Dual<double, 4>*, Interrupt*) const;
template void Experiment::residuals<Dual<double, 8>>(const Dual<double, 8>*, const Dual<double, 8>*, Dual<double, 8>*,
                                                     Dual<double, 8>*, Interrupt*) const;

}  // namespace sheetbend
