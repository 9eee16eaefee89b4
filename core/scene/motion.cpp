#include "core/scene/motion.h"

#include <algorithm>

namespace sheetbend {
namespace {

// Weights of knots i-1, i, i+1 for the slope at knot i; one-sided at the ends.
std::array<double, 3> slope_weights(const std::vector<double>& t, int i) {
  const int last = static_cast<int>(t.size()) - 1;
  if (last == 0) return {0.0, 0.0, 0.0};
  if (i == 0) return {0.0, -1.0 / (t[1] - t[0]), 1.0 / (t[1] - t[0])};
  if (i == last) return {-1.0 / (t[i] - t[i - 1]), 1.0 / (t[i] - t[i - 1]), 0.0};
  const double a = t[i] - t[i - 1], b = t[i + 1] - t[i];
  return {-b / (a * (a + b)), (b - a) / (a * b), a / (b * (a + b))};
}

}  // namespace

KnotWeights Knots::at(double t) const {
  const int last = static_cast<int>(times.size()) - 1;
  KnotWeights w;
  if (last == 0 || t <= times.front()) return w;
  if (t >= times.back()) {
    w.first = last;
    return w;
  }
  const int i = static_cast<int>(std::upper_bound(times.begin(), times.end(), t) - times.begin()) - 1;
  const double h = times[i + 1] - times[i], u = (t - times[i]) / h;
  if (interpolation == Interpolation::linear) {
    w.first = i;
    w.count = 2;
    w.weight = {1.0 - u, u, 0.0, 0.0};
    return w;
  }
  std::array<double, 4> full{};  // knots i-1 .. i+2
  full[1] = (1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u);
  full[2] = u * u * (3.0 - 2.0 * u);
  const double left = h * u * (1.0 - u) * (1.0 - u), right = h * u * u * (u - 1.0);
  const auto a = slope_weights(times, i), b = slope_weights(times, i + 1);
  for (int k = 0; k < 3; ++k) {
    full[k] += left * a[k];
    full[k + 1] += right * b[k];
  }
  const int begin = i == 0 ? 1 : 0, end = i + 2 > last ? 3 : 4;
  w.first = i - 1 + begin;
  w.count = end - begin;
  w.weight = {};
  for (int k = begin; k < end; ++k) w.weight[k - begin] = full[k];
  return w;
}

}  // namespace sheetbend
