// A sensor between a support and what moves it: a robot's wrist, a load cell. With the load F, T of the support about its place p
// (support.h), gravity g, and the sensor's axes R (to the world's) it reads, at a point q = p + R arm,
//
//   force   sign R^T (F + m (p'' - g)) + bias          torque   sign R^T (T - R arm cross F + R c cross m (p'' - g)) + bias
//
// m and c are mass and center (from q, in the sensor's axes) of the tool that it carries besides. The tool's own turning is left out. A
// sample is a mean over instants, at which loads are interpolated between substeps as markers are.
#pragma once

#include <array>

#include "adjoint/observe/markers.h"
#include "adjoint/observe/support.h"

namespace sheetbend {

// Slopes and second derivatives of cubic_weights by u.
template <class T>
std::array<T, 4> cubic_slopes(const T& u) {
  const T u2 = u * u, sixth(1.0 / 6.0), half(0.5), one(1.0), two(2.0), three(3.0), four(4.0), six(6.0);
  return {-(three * u2 - six * u + two) * sixth, (three * u2 - four * u - one) * half,
          -((three * u2 - two * u - two) * half), (three * u2 - one) * sixth};
}
template <class T>
std::array<T, 4> cubic_bends(const T& u) {
  const T one(1.0), two(2.0), three(3.0);
  return {one - u, three * u - two, one - three * u, u};
}

struct ForceSensor {
  // In an experiment's inputs: biases of force [N] and torque [N m], mass [kg] and center [m] of the tool, time offset [s].
  static constexpr int inputs = 11;
  static constexpr int channels = 6;

  SupportReader reader;
  std::array<double, 3> arm{};
  double sign = 1.0;              // -1 where the body's force on the support is read
  std::vector<double> times;      // (instants) [s], ascending
  std::vector<int> sample;        // (instants)
  std::vector<double> share;      // (instants) in the mean of the sample
  std::vector<double> rotation;   // (samples, 9) R by rows
  std::vector<double> measured;   // (samples, 6), NaN = not measured
  std::array<double, 6> sigma{};  // [N], [N m]

  std::size_t samples() const { return measured.size() / channels; }
  std::size_t rows() const {
    return std::count_if(measured.begin(), measured.end(), [](double m) { return !std::isnan(m); });
  }
};

template <class T>
Vec3<T> turned(const double* R, const Vec3<T>& a) {
  return {R[0] * a.x + R[1] * a.y + R[2] * a.z, R[3] * a.x + R[4] * a.y + R[5] * a.z,
          R[6] * a.x + R[7] * a.y + R[8] * a.z};
}
template <class T>
Vec3<T> turned_back(const double* R, const Vec3<T>& a) {
  return {R[0] * a.x + R[3] * a.y + R[6] * a.z, R[1] * a.x + R[4] * a.y + R[7] * a.z,
          R[2] * a.x + R[5] * a.y + R[8] * a.z};
}

// What a sensor reads along one rollout. `own` are its inputs, `in` the scene's.
template <class T>
class SensorRun {
 public:
  SensorRun(const ForceSensor& sensor, const Scene& scene, const T* in, const T* own, double h, double t0, int last)
      : sensor_(sensor), scene_(scene), in_{scene.layout, in}, own_(own), h_(h), t0_(t0), last_(last) {}

  // Whether the load at a substep will be asked for.
  bool wants(int step) const { return next_ < sensor_.times.size() && step >= base(next_) - 1; }

  void take(int step, const SupportLoad<T>& load) { load.store(ring_[step % 4].data()); }

  // Adds what is known by a substep to the samples' means (samples, 6).
  void read(int step, const T& weight, T* means) {
    for (; next_ < sensor_.times.size() && step >= base(next_) + 2; ++next_) {
      const int from = base(next_) - 1;
      const T u = place(next_) - T(from + 1.0), rate(1.0 / h_);
      const auto by = [&](const std::array<T, 4>& weights, int part) {
        Vec3<T> sum;
        for (int k = 0; k < 4; ++k) sum = sum + weights[k] * Vec3<T>(&ring_[(from + k) % 4][3 * part]);
        return sum;
      };
      const auto now = cubic_weights(u), slopes = cubic_slopes(u), bends = cubic_bends(u);
      const Vec3<T> gravity(in_.of(Quantity::gravity)), at = by(now, 2);
      const Vec3<T> inertia = (rate * rate) * by(bends, 3);
      const T mass = sensor_.reader.carried_mass(scene_, in_);
      const Vec3<T> load = by(now, 0) + inertia - mass * gravity;
      const Vec3<T> twist =
          by(now, 1) + rate * by(slopes, 4) - cross(at, inertia) - cross(by(now, 3) - mass * at, gravity);
      const Vec3<T> tool = own_[6] * ((rate * rate) * by(bends, 2) - gravity);
      const double* R = &sensor_.rotation[9 * static_cast<std::size_t>(sensor_.sample[next_])];
      const Vec3<T> arm = turned(R, Vec3<T>(T(sensor_.arm[0]), T(sensor_.arm[1]), T(sensor_.arm[2])));
      const Vec3<T> center = turned(R, Vec3<T>(own_ + 7));
      const T part = T(sensor_.sign * sensor_.share[next_]) * weight;
      T* to = means + ForceSensor::channels * static_cast<std::size_t>(sensor_.sample[next_]);
      (part * turned_back(R, load + tool)).add_to(to);
      (part * turned_back(R, twist - cross(arm, load) + cross(center, tool))).add_to(to + 3);
    }
  }

 private:
  T place(std::size_t instant) const { return (T(sensor_.times[instant] - t0_) + own_[10]) * T(1.0 / h_); }
  // There is no load at the start, before any substep.
  int base(std::size_t instant) const {
    return std::clamp(static_cast<int>(std::floor(value_of(place(instant)) + 1e-9)), 2, last_ - 2);
  }

  const ForceSensor& sensor_;
  const Scene& scene_;
  Inputs<const T> in_;
  const T* own_;
  double h_, t0_;
  int last_;
  std::size_t next_ = 0;
  std::array<std::array<T, SupportLoad<T>::size>, 4> ring_;
};

// Residuals of what was measured, from the samples' means without bias; adds the bias to these. Returns one past the last.
template <class T>
T* sensor_residuals(const ForceSensor& sensor, const T* own, T* means, T* r) {
  for (std::size_t i = 0; i < sensor.measured.size(); ++i) {
    const std::size_t channel = i % ForceSensor::channels;
    means[i] += own[channel];
    if (r && !std::isnan(sensor.measured[i]))
      *r++ = T(1.0 / sensor.sigma[channel]) * (means[i] - T(sensor.measured[i]));
  }
  return r;
}

}  // namespace sheetbend
