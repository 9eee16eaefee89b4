#include "adjoint/observe/experiment.h"

#include <algorithm>
#include <cmath>

#include "adjoint/observe/observation.h"
#include "adjoint/observe/settled.h"
#include "core/scalar/dual.h"

namespace sheetbend {

std::size_t Experiment::residual_count() const {
  std::size_t seen = 0;
  for (std::size_t i = 0; i < observed.measured.size(); i += 3) seen += !std::isnan(observed.measured[i]);
  std::size_t count = observed.rows_of_one() * seen;
  for (const ForceSensor& sensor : sensors) count += sensor.rows();
  return count;
}

std::size_t Experiment::readings() const {
  std::size_t count = 0;
  for (const ForceSensor& sensor : sensors) count += sensor.measured.size();
  return count;
}

int Experiment::steps(const Plan& run) const {
  if (is_static) return 0;
  double last = observed.times.back();
  for (const ForceSensor& sensor : sensors)
    if (!sensor.times.empty()) last = std::max(last, sensor.times.back());
  const int least = sensors.empty() ? 3 : 4;
  return std::max(least, static_cast<int>(std::ceil((last - t0) / run.options.h - 1e-9)) + 1);
}

template <class T>
int Experiment::steps_at(const Plan& run, const T* in) const {
  const int plain = steps(run);
  double most = plain;
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    if (sensors[s].times.empty()) continue;
    const double late = value_of(in[time_offset_at() + ForceSensor::inputs * (s + 1)]);
    most = std::max(most, std::ceil((sensors[s].times.back() + late - t0) / run.options.h - 1e-9) + 1.0);
  }
  return static_cast<int>(std::min(most, 2.0 * plain));
}

void Experiment::check() const {
  const std::size_t frames = observed.times.size(), columns = observed.columns();
  if (frames == 0 || columns == 0)
    throw std::invalid_argument(name + ": nothing is observed. Fix: give frames and markers");
  if (observed.measured.size() != 3 * frames * columns || observed.sigma.size() != frames * columns ||
      (observed.is_cloud() ? 0 : columns) != observed.markers.size())
    throw std::invalid_argument(name + ": measured and sigma must be (frames, markers, 3) and (frames, markers)");
  if (observed.is_cloud() && correction.unknowns() > 0)
    throw std::invalid_argument(name + ": a cloud does not go with an estimated start or corrected markers");
  if (is_static && frames != 1)
    throw std::invalid_argument(name + ": an equilibrium has one frame. Fix: give each shape as a recording");
  if (least.size() != most.size() || (!least.empty() && least.size() != scene->layout.total()))
    throw std::invalid_argument(name + ": the ranges do not fit the scene");
  if (map.terms().base.size() != inputs())
    throw std::invalid_argument(name + ": the parameter map does not fit the scene");
  if (correction.first.size() != correction.given.size() + 1 || correction.sigma.size() != correction.given.size())
    throw std::invalid_argument(name + ": the correction does not fit its own numbers");
  if (std::any_of(correction.sigma.begin() + correction.unknowns(), correction.sigma.end(),
                  [](double sigma) { return sigma != 0.0; }))
    throw std::invalid_argument(name + ": numbers that are estimated come before those that are not");
  if (is_static && !sensors.empty())
    throw std::invalid_argument(name + ": force sensors are read along motions, not at rest");
  if (correction.unknowns() > 0 && !sensors.empty())
    throw std::invalid_argument(
        name + ": neither a start nor driven markers are estimated beside force sensors. Fix: leave out one");
  for (const ForceSensor& sensor : sensors)
    if (sensor.measured.size() % ForceSensor::channels != 0 || sensor.rotation.size() != 9 * sensor.samples() ||
        sensor.times.size() != sensor.sample.size() || sensor.times.size() != sensor.share.size() ||
        !std::is_sorted(sensor.times.begin(), sensor.times.end()))
      throw std::invalid_argument(name + ": the arrays of a force sensor do not fit each other");
  if (residual_count() == 0) throw std::invalid_argument(name + ": every marker is missing in every frame");
  if (!finer.empty() && correction.unknowns() > 0)
    throw std::invalid_argument(
        name + ": neither a start nor driven markers are estimated under extrapolation in time. Fix: leave out one");
}

template <class T, class Frame>
void Experiment::run(const Plan& own, const T* in, Frame&& frame, double weight, T* means, Interrupt* interrupt) const {
  const T time_offset = in[time_offset_at()];
  const int last = steps_at(own, in);
  const std::size_t dofs = scene->dofs();
  std::vector<T> ring(4 * dofs), x(dofs);
  std::size_t next_frame = 0;
  Rollout<T> rollout(*scene, own, in, t0);
  const Inputs<const T> scene_in{scene->layout, in};
  std::vector<SensorRun<T>> runs;
  for (std::size_t s = 0; s < sensors.size(); ++s)
    runs.emplace_back(sensors[s], *scene, in, in + time_offset_at() + 1 + ForceSensor::inputs * s, own.options.h, t0,
                      last);
  const auto read = [&](int step, const T* x, const T* v) {
    if (step == 0) return;
    const T* lambda = nullptr;
    T* to = means;
    for (std::size_t s = 0; s < runs.size(); ++s, to += sensors[s - 1].measured.size()) {
      if (!runs[s].wants(step)) continue;
      if (!lambda) lambda = rollout.multipliers();
      runs[s].take(step, sensors[s].reader.read(*scene, scene_in, rollout.bdf().eta, rollout.time(step), x, v, lambda));
      runs[s].read(step, T(weight), to);
    }
  };
  rollout.run(
      last,
      [&](int step, const T* state, const T* speed) {
        read(step, state, speed);
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

// Of a cloud the coordinates are combined, since distances from the closest part of a surface are not linear in them.
template <class T>
std::vector<T> Experiment::extrapolated(const T* in, T* means, Interrupt* interrupt) const {
  const T* offsets = &in[scene->layout.total()];
  const std::size_t dofs = scene->dofs(), frames = observed.times.size();
  std::vector<T> seen(observed.is_cloud() ? frames * dofs : observed.measured.size(), T(0.0)), one(seen.size());
  const auto add = [&](const Plan& own, double weight) {
    run(
        own, in,
        [&](std::size_t f, const T* x) {
          if (observed.is_cloud())
            std::copy_n(x, dofs, &one[f * dofs]);
          else
            frame_residuals(observed, f, x, offsets, static_cast<T*>(nullptr), one.data());
        },
        weight, means, interrupt);
    for (std::size_t i = 0; i < seen.size(); ++i) seen[i] += T(weight) * one[i];
  };
  double rest = 1.0;
  for (const FinerRun& one_more : finer) rest -= one_more.weight;
  add(plan, rest);
  for (const FinerRun& one_more : finer) add(one_more.plan, one_more.weight);
  return seen;
}

void Experiment::refuse(std::size_t input, double value) const {
  int q = 0;
  while (input >= scene->layout.offset[q + 1]) ++q;
  throw OutOfDomain(std::string(quantity_names[q]) + ": entry " + std::to_string(input - scene->layout.offset[q]) +
                    " would be " + std::to_string(value) +
                    ". Fix: bound the parameters that it is made from, or start elsewhere");
}

template <class T>
void Experiment::residuals(const T* theta, const T* b, T* r, T* simulated, T* sensed, Interrupt* interrupt) const {
  std::vector<T> in = inputs_at(theta, b);
  const T* offsets = &in[scene->layout.total()];
  if (is_static || start == Start::equilibrium) {
    const std::vector<T> x = equilibrium_coordinates<T>(*scene, in.data(), equilibrium, *anchor, interrupt);
    if (is_static) {
      frame_residuals(observed, 0, x.data(), offsets, r, simulated);
      return;
    }
    std::copy(x.begin(), x.end(), in.begin() + static_cast<std::ptrdiff_t>(scene->layout.of(Quantity::position)));
  } else if (start == Start::settled) {
    const std::vector<T> x = settled_coordinates(*scene, *settling, in.data(), t0);
    std::copy(x.begin(), x.end(), in.begin() + static_cast<std::ptrdiff_t>(scene->layout.of(Quantity::position)));
  }

  std::vector<T> means(readings(), T(0.0));
  if (finer.empty()) {
    run(
        plan, in.data(), [&](std::size_t f, const T* x) { r = frame_residuals(observed, f, x, offsets, r, simulated); },
        1.0, means.data(), interrupt);
  } else {
    const std::vector<T> seen = extrapolated(in.data(), means.data(), interrupt);
    if (observed.is_cloud()) {
      for (std::size_t f = 0; f < observed.times.size(); ++f)
        r = frame_residuals(observed, f, &seen[f * scene->dofs()], offsets, r, simulated);
    } else {
      if (simulated) std::copy(seen.begin(), seen.end(), simulated);
      for (std::size_t at = 0; r && at < seen.size() / 3; ++at)
        if (is_seen(observed, at)) r = marker_residuals(observed, at, Vec3<T>(&seen[3 * at]), r);
    }
  }
  T* mean = means.data();
  for (std::size_t s = 0; s < sensors.size(); mean += sensors[s++].measured.size())
    r = sensor_residuals(sensors[s], &in[time_offset_at() + 1 + ForceSensor::inputs * s], mean, r);
  if (sensed) std::copy(means.begin(), means.end(), sensed);
}

template void Experiment::residuals<double>(const double*, const double*, double*, double*, double*, Interrupt*) const;
template void Experiment::residuals<Dual<double, 4>>(const Dual<double, 4>*, const Dual<double, 4>*, Dual<double, 4>*,
                                                     Dual<double, 4>*, Dual<double, 4>*, Interrupt*) const;
template void Experiment::residuals<Dual<double, 8>>(const Dual<double, 8>*, const Dual<double, 8>*, Dual<double, 8>*,
                                                     Dual<double, 8>*, Dual<double, 8>*, Interrupt*) const;

}  // namespace sheetbend
