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

int Experiment::steps() const {
  if (is_static) return 0;
  return std::max(3, static_cast<int>(std::ceil((observed.times.back() - t0) / plan.options.h - 1e-9)) + 1);
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
  const T time_offset = in.back();
  if (is_static || start == Start::equilibrium) {
    const std::vector<T> x = equilibrium_coordinates<T>(*scene, in.data(), equilibrium, *anchor, interrupt);
    if (is_static) {
      frame_residuals(observed, 0, x.data(), offsets, r, simulated);
      return;
    }
    std::copy(x.begin(), x.end(), in.begin() + static_cast<std::ptrdiff_t>(scene->layout.of(Quantity::position)));
  }

  const int last = steps();
  const std::size_t dofs = scene->dofs();
  std::vector<T> ring(4 * dofs), x(dofs);
  std::size_t next_frame = 0;
  Rollout<T> rollout(*scene, plan, in.data(), t0);
  rollout.run(
      last,
      [&](int step, const T* state, const T*) {
        std::copy_n(state, dofs, &ring[(step % 4) * dofs]);
        for (; next_frame < observed.times.size(); ++next_frame) {
          const FramePlace<T> place(*this, next_frame, time_offset, last);
          if (step < place.base + 2) return;
          place.interpolate(dofs, [&](int k) { return &ring[((place.base - 1 + k) % 4) * dofs]; }, x.data());
          r = frame_residuals(observed, next_frame, x.data(), offsets, r, simulated);
        }
      },
      interrupt);
}

template void Experiment::residuals<double>(const double*, const double*, double*, double*, Interrupt*) const;
template void Experiment::residuals<Dual<double, 4>>(const Dual<double, 4>*, const Dual<double, 4>*, Dual<double, 4>*,
                                                     Dual<double, 4>*, Interrupt*) const;
template void Experiment::residuals<Dual<double, 8>>(const Dual<double, 8>*, const Dual<double, 8>*, Dual<double, 8>*,
                                                     Dual<double, 8>*, Interrupt*) const;

}  // namespace sheetbend
