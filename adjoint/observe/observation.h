// What an experiment sees of a rollout: where its frames lie between substeps, and the residuals of one marker in one frame.
#pragma once

#include <algorithm>
#include <cmath>

#include "adjoint/observe/experiment.h"

namespace sheetbend {

// The factor on a marker's residuals whose squares then sum to the robust loss rho(s) scale^2, s = squared distance / scale^2.
// Huber 1964 and its smooth form soft-L1, and Cauchy's log(1 + s); all are the squares themselves for small residuals.
template <class T>
T robust_scale(const Observations& o, const T& distance2) {
  if (o.loss == Loss::squares) return T(1.0);
  const T s = distance2 * T(1.0 / (o.loss_scale * o.loss_scale));
  if (o.loss == Loss::cauchy) {
    if (value_of(s) > 1e-3) return sqrt(log(T(1.0) + s) / s);
    return sqrt(T(1.0) - s * (T(1.0 / 2.0) - s * (T(1.0 / 3.0) - s * (T(1.0 / 4.0) - s * T(1.0 / 5.0)))));
  }
  if (o.loss == Loss::soft_l1) return sqrt(T(2.0) / (T(1.0) + sqrt(T(1.0) + s)));
  const auto far = s > T(1.0);
  const T safe = select(far, s, T(1.0));
  return select(far, sqrt((T(2.0) * sqrt(safe) - T(1.0)) / safe), T(1.0));
}

inline bool is_seen(const Observations& o, std::size_t at) { return !std::isnan(o.measured[3 * at]); }

// Residuals of a marker that was seen, one per axis, from where it is simulated; at = frame * markers + marker. Returns one past the last.
template <class T>
T* marker_residuals(const Observations& o, std::size_t at, const Vec3<T>& p, T* r) {
  const double* seen = &o.measured[3 * at];
  const T place[3] = {p.x, p.y, p.z};
  T d[3]{};
  for (const int axis : o.axes) d[axis] = T(1.0 / o.sigma[at]) * (place[axis] - T(seen[axis]));
  const T scale = robust_scale(o, dot(Vec3<T>(d), Vec3<T>(d)));
  for (const int axis : o.axes) *r++ = scale * d[axis];
  return r;
}

// The same of a cloud, whose residuals are the points' distances from the shape; its simulated points are the closest ones on it.
template <class T, class Shape>
T* cloud_residuals(const Observations& o, const Shape& s, std::size_t frame, const T* x, T* r, T* simulated) {
  std::vector<double> values;
  for (const int dof : s.vertices)
    for (int d = 0; d < 3; ++d) values.push_back(value_of(x[dof + d]));
  const std::size_t count = o.columns(), first = frame * count;
  const auto parts = closest_parts(s, values.data(), &o.measured[3 * first], count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = first + i;
    T own[12];
    for (int d = 0; d < 3; ++d) own[d] = T(o.measured[3 * at + d]);
    if (parts[i].is_none()) {
      if (simulated) Vec3<T>(own).store(simulated + 3 * at);
      continue;
    }
    T* corner = own;
    for (const int vertex : corners_of(s, parts[i])) Vec3<T>(x + s.vertices[vertex]).store(corner += 3);
    if (simulated) closest_place(own, parts[i]).store(simulated + 3 * at);
    if (!r) continue;
    auto off = distances(own, parts[i], o.sigma[at]);
    T squared(0.0);
    for (T& d : off) {
      d = T(1.0 / o.sigma[at]) * d;
      squared += d * d;
    }
    const T scale = robust_scale(o, squared);
    for (const T& d : off) *r++ = scale * d;
  }
  return r;
}

// Residuals of one frame (not where r is null), and simulated markers (likewise), from the coordinates x at its time.
template <class T>
T* frame_residuals(const Observations& o, std::size_t frame, const T* x, const T* offsets, T* r, T* simulated) {
  if (const auto* cloth = std::get_if<ClothSurface>(&o.shape))
    return cloud_residuals(o, *cloth, frame, x, r, simulated);
  if (const auto* ropes = std::get_if<RopeLines>(&o.shape)) return cloud_residuals(o, *ropes, frame, x, r, simulated);
  const std::size_t count = o.markers.size();
  for (std::size_t m = 0; m < count; ++m) {
    const std::size_t at = frame * count + m;
    const Vec3<T> p = marker_position(o.markers[m], x, offsets + 3 * m);
    if (simulated) p.store(simulated + 3 * at);
    if (r && is_seen(o, at)) r = marker_residuals(o, at, p, r);
  }
  return r;
}

// A frame lies between substeps `base` and base + 1, and is interpolated from base - 1 to base + 2.
template <class T>
struct FramePlace {
  int base;
  std::array<T, 4> weight;

  FramePlace(const Experiment& e, const Plan& run, std::size_t frame, const T& time_offset, int last) {
    const T place = (T(e.observed.times[frame] - e.t0) + time_offset) * T(1.0 / run.options.h);
    base = std::clamp(static_cast<int>(std::floor(value_of(place) + 1e-9)), 1, last - 2);
    weight = cubic_weights(place - T(base));
  }

  // x (dofs) from state(k), the coordinates at base - 1 + k.
  template <class State>
  void interpolate(std::size_t dofs, State&& state, T* x) const {
    const T* at[4] = {state(0), state(1), state(2), state(3)};
    for (std::size_t i = 0; i < dofs; ++i) {
      T sum(0.0);
      for (int k = 0; k < 4; ++k) sum += weight[k] * at[k][i];
      x[i] = sum;
    }
  }
};

}  // namespace sheetbend
