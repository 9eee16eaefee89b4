#include "adjoint/experiment.h"

#include <algorithm>
#include <cmath>

#include "core/scalar/dual.h"

namespace sheetbend {
namespace {

// The factor on a marker's residuals whose squares then sum to the robust loss rho(s) scale^2, s = squared distance / scale^2.
// Huber 1964 and its smooth form soft-L1; both are the squares themselves for small residuals.
template <class T>
T robust_scale(const Observations& o, const T& distance2) {
  if (o.loss == Loss::squares) return T(1.0);
  const T s = distance2 * T(1.0 / (o.loss_scale * o.loss_scale));
  if (o.loss == Loss::soft_l1) return sqrt(T(2.0) / (T(1.0) + sqrt(T(1.0) + s)));
  const auto far = s > T(1.0);
  const T safe = select(far, s, T(1.0));
  return select(far, sqrt((T(2.0) * sqrt(safe) - T(1.0)) / safe), T(1.0));
}

template <class T>
class ResidualWriter {
 public:
  ResidualWriter(const Experiment& e, const T* offsets, T* r, T* simulated)
      : o_(e.observed), offsets_(offsets), r_(r), simulated_(simulated) {}

  // The state at the time of one frame.
  void frame(std::size_t f, const T* x) {
    const std::size_t count = o_.markers.size();
    for (std::size_t m = 0; m < count; ++m) {
      const std::size_t at = f * count + m;
      const Vec3<T> p = marker_position(o_.markers[m], x, offsets_ + 3 * m);
      if (simulated_) p.store(simulated_ + 3 * at);
      const double* seen = &o_.measured[3 * at];
      if (!r_ || std::isnan(seen[0])) continue;
      const T place[3] = {p.x, p.y, p.z};
      T d[3]{};
      for (const int axis : o_.axes) d[axis] = T(1.0 / o_.sigma[at]) * (place[axis] - T(seen[axis]));
      const T scale = robust_scale(o_, dot(Vec3<T>(d), Vec3<T>(d)));
      for (const int axis : o_.axes) *r_++ = scale * d[axis];
    }
  }

 private:
  const Observations& o_;
  const T* offsets_;
  T *r_, *simulated_;
};

}  // namespace

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
  if (map.base.size() != inputs()) throw std::invalid_argument(name + ": the parameter map does not fit the scene");
  if (residual_count() == 0) throw std::invalid_argument(name + ": every marker is missing in every frame");
}

template <class T>
void Experiment::residuals(const T* theta, T* r, T* simulated, Interrupt* interrupt) const {
  std::vector<T> in(inputs());
  map.apply(theta, in.data());
  const std::size_t scene_inputs = scene->layout.total();
  const T* offsets = &in[scene_inputs];
  const T time_offset = in.back();
  ResidualWriter<T> writer(*this, offsets, r, simulated);
  if (is_static || start == Start::equilibrium) {
    const std::vector<T> x = equilibrium_coordinates<T>(*scene, in.data(), equilibrium, *anchor, interrupt);
    if (is_static) return writer.frame(0, x.data());
    std::copy(x.begin(), x.end(), in.begin() + static_cast<std::ptrdiff_t>(scene->layout.of(Quantity::position)));
  }

  // A frame lies between substeps `base` and base + 1; it is written as soon as base + 2 is known.
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
          const T place = (T(observed.times[next_frame] - t0) + time_offset) * T(1.0 / plan.options.h);
          const int base = std::clamp(static_cast<int>(std::floor(value_of(place) + 1e-9)), 1, last - 2);
          if (step < base + 2) return;
          const auto weights = cubic_weights(place - T(base));
          for (std::size_t i = 0; i < dofs; ++i) {
            T sum(0.0);
            for (int k = 0; k < 4; ++k) sum += weights[k] * ring[((base - 1 + k) % 4) * dofs + i];
            x[i] = sum;
          }
          writer.frame(next_frame, x.data());
        }
      },
      interrupt);
}

template void Experiment::residuals<double>(const double*, double*, double*, Interrupt*) const;
template void Experiment::residuals<Dual<double, 4>>(const Dual<double, 4>*, Dual<double, 4>*, Dual<double, 4>*,
                                                     Interrupt*) const;
template void Experiment::residuals<Dual<double, 8>>(const Dual<double, 8>*, Dual<double, 8>*, Dual<double, 8>*,
                                                     Interrupt*) const;

}  // namespace sheetbend
