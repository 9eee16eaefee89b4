// The volume inside a closed surface, kept by one constraint on all its vertices (Macklin et al. 2016, section 6.5):
//
//   C = V - V0,   V = sum x0 . (x1 x x2) / 6 over triangles,   dV/dx_k = sum x_i x x_j / 6 over those around vertex k,
//
// with the energy C^2 / (2 alpha), alpha in m^3/Pa. lambda/eta^2 is the pressure inside above that outside. Fixed vertices take part in V and stay
// where they are. One thread works, in the order of triangles and nodes, so bits do not depend on their number.
#pragma once

#include <algorithm>
#include <vector>

#include "core/scalar/point.h"
#include "core/scene/scene.h"

namespace sheetbend {

// What the reverse needs of one projection: coordinates and multiplier before it, and the correction. Coordinates count from the first node: nothing
// depends on where a closed surface is, and digits are kept far from the origin.
template <class T>
struct VolumeRecord {
  std::vector<Vec3<T>> x;
  T lambda{}, dl{};
};

template <class T>
struct VolumeState {
  std::vector<VolumeRecord<T>> iterations;  // all, or the last one
  std::vector<Vec3<T>> gradient;
  T lambda{};

  void resize(const Volume& volume, int kept_iterations) {
    iterations.resize(std::max(1, kept_iterations));
    for (VolumeRecord<T>& record : iterations) record.x.resize(volume.nodes.size());
    gradient.resize(volume.nodes.size());
  }
  static std::size_t bytes(const Volume& volume, int kept_iterations) {
    const std::size_t records = std::max(1, kept_iterations);
    return records * sizeof(VolumeRecord<T>) + (records + 1) * sizeof(Vec3<T>) * volume.nodes.size();
  }
  VolumeRecord<T>& record(int iteration) { return iterations[iterations.size() == 1 ? 0 : iteration]; }
};

// Coordinates of a volume's nodes from the first one; point(k) is where node k of the volume is.
template <class T, class Point>
void place_volume(Point&& point, std::vector<Vec3<T>>& x) {
  const Vec3<T> first = point(0);
  for (std::size_t k = 0; k < x.size(); ++k) x[k] = point(k) - first;
}

// V, and its gradient.
template <class T>
T enclosed(const Volume& volume, const std::vector<Vec3<T>>& x, std::vector<Vec3<T>>& gradient) {
  std::fill(gradient.begin(), gradient.end(), Vec3<T>());
  T sum(0.0);
  for (const auto& [a, b, c] : volume.triangles) {
    const Vec3<T> by_a = cross(x[b], x[c]);
    sum += dot(x[a], by_a);
    gradient[a] = gradient[a] + by_a;
    gradient[b] = gradient[b] + cross(x[c], x[a]);
    gradient[c] = gradient[c] + cross(x[a], x[b]);
  }
  for (Vec3<T>& g : gradient) g = scaled(1.0 / 6.0, g);
  return T(1.0 / 6.0) * sum;
}

// Hess(V) v, node by node, to add(node of the volume, share).
template <class T, class Add>
void for_each_hessian_times(const Volume& volume, const std::vector<Vec3<T>>& x, const std::vector<Vec3<T>>& v,
                            Add&& add) {
  const auto share = [&](int a, int b, int c) { add(a, scaled(1.0 / 6.0, cross(v[b], x[c]) + cross(x[b], v[c]))); };
  for (const auto& [a, b, c] : volume.triangles) {
    share(a, b, c);
    share(b, c, a);
    share(c, a, b);
  }
}

// The row of a volume at recorded coordinates; `gradient` receives dV/dx.
template <class T>
struct VolumeRow {
  T a, C, D;  // alpha/eta^2, and what a correction divides by

  VolumeRow(const Scene& scene, const Inputs<const T>& in, double eta, const T* w, int i, const VolumeRecord<T>& at,
            std::vector<Vec3<T>>& gradient)
      : a(in.of(Quantity::volume_compliance)[i] * T(1.0 / (eta * eta))),
        C(enclosed(scene.volumes[i], at.x, gradient) - in.of(Quantity::volume)[i]),
        D(a) {
    const std::vector<int>& nodes = scene.volumes[i].nodes;
    for (std::size_t k = 0; k < nodes.size(); ++k) D += w[nodes[k]] * dot(gradient[k], gradient[k]);
  }
};

// One projection of every volume. at(node, d) is where a coordinate stands; the first iteration (0) starts from no multipliers.
template <class T, class At>
void project_volumes(const Scene& scene, const Inputs<const T>& in, double eta, const T* w, int iteration, At&& at,
                     std::vector<VolumeState<T>>& states) {
  for (int i = 0; i < static_cast<int>(states.size()); ++i) {
    VolumeState<T>& state = states[i];
    VolumeRecord<T>& record = state.record(iteration);
    const std::vector<int>& nodes = scene.volumes[i].nodes;
    place_volume([&](std::size_t k) { return Vec3<T>(T(at(nodes[k], 0)), T(at(nodes[k], 1)), T(at(nodes[k], 2))); },
                 record.x);
    record.lambda = iteration == 0 ? T(0.0) : state.lambda;
    const VolumeRow<T> row(scene, in, eta, w, i, record, state.gradient);
    record.dl = -(row.C + row.a * record.lambda) / row.D;
    state.lambda = record.lambda + record.dl;
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      if (scene.role[nodes[k]] != Role::free) continue;
      T move[3];
      ((w[nodes[k]] * record.dl) * state.gradient[k]).store(move);
      for (int d = 0; d < 3; ++d) at(nodes[k], d) = T(at(nodes[k], d)) + move[d];
    }
  }
}

}  // namespace sheetbend
